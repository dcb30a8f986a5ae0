"use strict";
// A shape view on a page: its data, camera and controls, and the interface window.toolpointViews[name].
(function () {
  const say = (text) => (window.ToolpointSay ? window.ToolpointSay(text) : text); // a page around it may have words of its own
  window.toolpointViews = window.toolpointViews || {};
  const PALETTE = [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [230, 159, 0], [86, 180, 233],
    [140, 140, 140], [160, 140, 60]];
  const HOME = { azimuth: -0.95, elevation: 0.42, zoom: 1, pan: [0, 0] };
  const VIEWS = { "3D": [-0.95, 0.42], Front: [-Math.PI / 2, 0], Side: [0, 0], Top: [-Math.PI / 2, Math.PI / 2 - 1e-3] };
  const FIELD = 0.42; // vertical field of view, rad

  const COARSE_FROM = 6000, COARSE_CELLS = 20; // faces above which a moving scene may be coarse; cells along its longest side
  const PAPER = [[255, 255, 255], [255, 255, 255]];

  // Fewer faces of the same scene: nodes of a body that lie in one cell of a grid count as the first of them.
  function coarseFaces(pane, faces, centre, radius) {
    if (faces.length < 3 * COARSE_FROM) return new Uint32Array(0);
    const size = 2 * radius / COARSE_CELLS, first = new Map(), of = new Uint32Array(pane.count);
    for (let i = 0; i < pane.count; i++) {
      let key = pane.body[i] * 2 + pane.known[i];
      for (let j = 0; j < 3; j++) key = key * 4 * COARSE_CELLS + Math.floor((pane.nodes[3 * i + j] - centre[j]) / size) + 2 * COARSE_CELLS;
      if (!first.has(key)) first.set(key, i);
      of[i] = first.get(key);
    }
    const drawn = new Set(), coarse = [];
    for (let i = 0; i < faces.length; i += 3) {
      const [a, b, c] = [of[faces[i]], of[faces[i + 1]], of[faces[i + 2]]];
      if (a === b || b === c || c === a) continue;
      const key = [a, b, c].sort((p, q) => p - q).join();
      if (drawn.has(key)) continue;
      drawn.add(key); coarse.push(a, b, c);
    }
    return Uint32Array.from(coarse);
  }

  const bytes = (packed) => window.ToolpointData(packed);
  function make(tag, attributes, ...children) {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {}))
      key === "text" ? node.textContent = value : node.setAttribute(key, value);
    node.append(...children);
    return node;
  }
  function shapeOf(packed, count) { // 16-bit parts of the largest component -> floats
    const part = (text) => {
      const out = new Float32Array(3 * count);
      if (text) new Int16Array(bytes(text)).forEach((v, i) => { out[i] = v / 32767 * packed.unit; });
      return out;
    };
    return { real: part(packed.real), imaginary: part(packed.imaginary) };
  }
  function amplitude(shape) {
    let peak = 0;
    for (let i = 0; i < shape.real.length; i += 3) {
      let s = 0;
      for (let j = i; j < i + 3; j++) s += shape.real[j] ** 2 + shape.imaginary[j] ** 2;
      if (s > peak) peak = s;
    }
    return Math.sqrt(peak);
  }
  const hertz = (f) => (f >= 1000 ? f.toFixed(0) : f >= 100 ? f.toFixed(1) : f.toFixed(2)) + " Hz";
  const percent = (z) => "ζ " + (100 * z).toFixed(Math.abs(z) < 0.1 ? 2 : 1) + " %";

  class View {
    constructor(root, data) {
      this.root = root; this.data = data; this.still = data.still; this.mode = 0; this.phase = 0; this.amplitude = 1; this.colouring = 0;
      this.ghost = true; this.camera = { ...HOME, pan: [0, 0] }; this.frames = 0; this.hidden = new Set();
      this.playing = !this.still && !matchMedia("(prefers-reduced-motion: reduce)").matches;
      if (this.still) this.ghost = false;
      this.seen = true; this.dirty = true; this.last = null; this.pace = 1000 / 60; this.level = 0;
      this.panes = data.panes.map((pane) => this.unpacked(pane));
      this.build();
      try { this.start(); } catch (error) { this.refuse(String(error.message || error)); return; }
      window.ToolpointControls(this);
      this.showMode(0);
      new ResizeObserver(() => this.touch()).observe(this.canvas);
      new IntersectionObserver((entries) => { this.seen = entries.at(-1).isIntersecting; this.touch(); }).observe(root);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.touch());
      window.addEventListener("beforeprint", () => this.print());
      matchMedia("print").addEventListener("change", (event) => { if (event.matches) this.print(); });
      window.addEventListener("afterprint", () => { this.isPrinted = false; this.touch(); });
      this.canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); this.lost = true; });
      this.canvas.addEventListener("webglcontextrestored", () => { this.start(); this.showMode(this.mode); });
      const tick = (now) => { this.advance(now); requestAnimationFrame(tick); };
      requestAnimationFrame(tick);
    }

    unpacked(pane) {
      const index = (text) => Uint32Array.from(pane.wide ? new Uint32Array(bytes(text)) : new Uint16Array(bytes(text)));
      const nodes = new Float32Array(bytes(pane.nodes)), count = nodes.length / 3;
      const body = new Uint16Array(bytes(pane.body)), known = new Uint8Array(bytes(pane.known));
      const tint = new Float32Array(4 * count);
      for (let i = 0; i < count; i++) {
        PALETTE[body[i] % PALETTE.length].forEach((c, j) => { tint[4 * i + j] = c / 255; });
        tint[4 * i + 3] = known[i];
      }
      return { nodes, count, body, known, tint, triangles: index(pane.triangles), lines: index(pane.lines),
        bodies: pane.bodies, dots: pane.dots, shapes: pane.shapes, loaded: [], title: pane.title, like: pane.like };
    }

    build() {
      this.canvas = make("canvas", { tabindex: "0", role: "img", "aria-label":
        say("Animated shape. Drag or arrow keys turn, shift moves, wheel or plus and minus zoom, space plays, n and p change the mode.") });
      this.coarseNote = make("div", { class: "tp-coarse", text: say("coarser while it moves"), hidden: "" });
      this.stage = make("div", { class: "tp-stage" }, this.canvas, this.coarseNote);
      this.side = make("div", { class: "tp-side" });
      this.bar = make("div", { class: "tp-bar" });
      this.root.replaceChildren(make("div", { class: "tp-main" }, this.stage, this.bar), this.side);
      this.buildModes();
    }

    buildModes() {
      const list = make("div", { class: "tp-modes", role: "group", "aria-label": say("Modes") });
      this.buttons = this.panes[0].shapes.map((shape, i) => {
        const button = make("button", { type: "button", "aria-pressed": "false" }, make("b", { text: String(i + 1) }));
        for (const pane of this.panes.filter((each) => each.like === undefined)) {
          const one = pane.shapes[i];
          button.append(make("span", { class: "tp-f", text: hertz(one.frequency) }),
            make("span", { class: "tp-z", text: percent(one.damping) }));
        }
        if (shape.label) button.append(make("span", { class: "tp-l", text: shape.label }));
        button.addEventListener("click", () => this.showMode(i));
        list.append(button);
        return button;
      });
      if (!this.still) this.side.append(make("h4", { "aria-level": "3", text: say("Modes") }), list);
    }

    refuse(reason) {
      this.failed = reason;
      this.stage.replaceChildren(make("div", { class: "tp-message", role: "alert" },
        make("strong", { text: "The shape cannot be animated here." }),
        make("p", { text: "This browser offers no WebGL2 (" + reason + "). Switch on hardware acceleration in its settings, "
          + "or open the page in a current Firefox, Chrome, Edge or Safari. Frequencies and damping are in the list." })));
      this.bar.remove();
      for (const button of this.buttons) button.disabled = true;
    }

    start() {
      this.lost = false;
      this.renderer = new window.ToolpointRenderer(this.canvas, this.data.ramp);
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (const pane of this.panes) pane.nodes.forEach((v, i) => {
        low[i % 3] = Math.min(low[i % 3], v); high[i % 3] = Math.max(high[i % 3], v);
      });
      this.centre = low.map((v, i) => (v + high[i]) / 2);
      this.radius = Math.hypot(...low.map((v, i) => high[i] - v)) / 2 || 1;
      this.panes.forEach((pane, k) => { this.renderer.addPane(pane); this.elements(k); });
    }

    elements(k) { // faces and edges whose nodes are all on visible bodies
      const pane = this.panes[k], shown = (i) => !this.hidden.has(pane.bodies[pane.body[i]]);
      const kept = (index, width) => {
        const out = [];
        for (let i = 0; i < index.length; i += width) {
          let all = true;
          for (let j = 0; j < width; j++) all = all && shown(index[i + j]);
          if (all) for (let j = 0; j < width; j++) out.push(index[i + j]);
        }
        return Uint32Array.from(out);
      };
      const dots = [];
      for (let i = 0; i < pane.count; i++) if (pane.dots && shown(i)) dots.push(i);
      const faces = kept(pane.triangles, 3);
      this.renderer.setElements(k, faces, kept(pane.lines, 2), Uint32Array.from(dots), coarseFaces(pane, faces, this.centre, this.radius));
    }

    touch() { this.dirty = true; }

    showMode(i) {
      if (!(i >= 0 && i < this.buttons.length)) throw new RangeError("mode " + i + " of " + this.buttons.length);
      this.mode = i;
      this.buttons.forEach((button, j) => button.setAttribute("aria-pressed", String(i === j)));
      this.panes.forEach((pane, k) => {
        pane.loaded[i] = pane.loaded[i] || shapeOf(pane.shapes[i], pane.count);
        this.load(k, pane.loaded[i], pane.like !== undefined ? pane.title : this.still ? pane.title : (this.panes.length > 1 && pane.title ? pane.title + ": " : "")
          + "mode " + (i + 1) + ", " + hertz(pane.shapes[i].frequency) + ", " + percent(pane.shapes[i].damping));
      });
    }

    load(k, shape, text) {
      const pane = this.panes[k];
      pane.shape = shape; pane.peak = this.still ? this.still[3] : pane.like !== undefined ? this.panes[pane.like].peak : amplitude(shape);
      if (this.renderer) this.renderer.setShape(k, shape.real, shape.imaginary, pane.peak);
      if (pane.caption) pane.caption.textContent = text;
      this.dirty = true;
    }

    setShape(shape, k = 0) { // {real: 3n numbers, imaginary: 3n or none, frequency, damping, label}
      const pane = this.panes[k], real = Float32Array.from(shape.real);
      const imaginary = shape.imaginary ? Float32Array.from(shape.imaginary) : new Float32Array(real.length);
      if (real.length !== 3 * pane.count || imaginary.length !== real.length)
        throw new RangeError("shape has " + real.length + " values, the scene needs " + 3 * pane.count);
      this.buttons.forEach((button) => button.setAttribute("aria-pressed", "false"));
      const words = [shape.label, shape.frequency == null ? "" : hertz(shape.frequency),
        shape.damping == null ? "" : percent(shape.damping)].filter(Boolean);
      this.load(k, { real, imaginary }, words.join(", "));
    }

    scale(k) { if (this.still) return 0; const p = this.panes[k].peak; return p > 0 ? this.amplitude * 0.12 * this.radius / p : 0; }
    setPhase(phase) { this.play(false); this.phase = phase; this.changed(); this.render(); }
    setAmplitude(factor) { this.amplitude = factor; this.changed(); }
    play(on = true) { this.playing = on; this.last = null; this.changed(); }
    changed() { this.dirty = true; if (this.refresh) this.refresh(); }

    // While a slow machine plays below 30 frames/s it goes without smoothing (1), then without the undeformed outline (2)
    // and the edges (3) of large meshes, then with fewer faces at a lower resolution, in a frame without round corners, which a
    // browser cuts out of every picture (4). A still picture always has all, but while `isHeld`: a slider that is on its way draws
    // one after the other without smoothing.
    paced(step) {
      if (step > 500) return;
      this.pace += 0.12 * (step - this.pace);
      if (this.level < 4 && this.pace > 31) { this.level += 1; this.pace = 1000 / 60; }
    }

    advance(now) {
      if (this.playing && this.seen && this.last !== null) {
        this.paced(now - this.last);
        this.phase = (this.phase + 2 * Math.PI * (now - this.last) / 2000) % (2 * Math.PI);
        this.dirty = true; // the slider follows a few times a second: painting it costs more than the shape
        if (this.refresh && !(now - this.told < 150)) { this.refresh(); this.told = now; }
      }
      this.last = now;
      if (this.dirty && this.seen) this.render();
    }

    matrices() {
      const { azimuth, elevation, zoom, pan } = this.camera, aspect = this.canvas.width / this.panes.length / this.canvas.height;
      const back = [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];
      const right = [-Math.sin(azimuth), Math.cos(azimuth), 0];
      const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2],
        back[0] * right[1] - back[1] * right[0]];
      const distance = 1.02 * this.radius / Math.sin(FIELD / 2) / Math.min(1, aspect) / zoom;
      const eye = this.centre.map((c, i) => c + distance * back[i] - pan[0] * right[i] - pan[1] * up[i]);
      const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const view = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
        -dot(right, eye), -dot(up, eye), -dot(back, eye), 1];
      const near = Math.max(distance - 3 * this.radius, 0.02 * distance), far = distance + 4 * this.radius;
      const f = 1 / Math.tan(FIELD / 2);
      this.axes = { right, up, back }; this.perPixel = 2 * distance * Math.tan(FIELD / 2) / this.canvas.clientHeight;
      return { view, projection: [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
        0, 0, 2 * far * near / (near - far), 0] };
    }

    render() {
      if (this.lost || !this.renderer || !this.canvas.clientWidth) return;
      const ratio = Math.min(devicePixelRatio || 1, 2) * (this.playing && !this.isPrinted && this.level > 3 ? 0.7 : 1);
      const w = Math.round(this.canvas.clientWidth * ratio), h = Math.round(this.canvas.clientHeight * ratio);
      if (this.canvas.width !== w || this.canvas.height !== h) { this.canvas.width = w; this.canvas.height = h; }
      const isPaper = this.isPrinted || matchMedia("print").matches, level = isPaper ? 0 : this.playing ? this.level : this.isHeld ? 1 : 0;
      const dark = matchMedia("(prefers-color-scheme: dark)").matches && !isPaper;
      this.simplify(level > 3);
      this.renderer.draw({ ...this.matrices(), phase: this.phase, scales: this.panes.map((_, k) => this.scale(k)),
        colouring: this.colouring, ratio, level, backdrop: isPaper ? PAPER : this.backdrop(dark), edge: dark ? [0.93, 0.95, 0.98, 0.75] : [0.08, 0.1, 0.15, 0.75],
        ghost: this.ghost ? (dark ? [0.75, 0.8, 0.9, 0.35] : [0.35, 0.4, 0.5, 0.4]) : null });
      this.dirty = false; this.frames += 1;
      if (this.drawAxes) this.drawAxes();
    }

    // A WebGL canvas is empty once it was shown: a printer gets a plain picture, taken while the drawing is still there.
    print() {
      this.isPrinted = true;
      this.render();
      if (!this.printed) {
        this.printed = make("canvas", { class: "tp-print", "aria-hidden": "true", "aria-label": "The shape as it is printed" });
        this.canvas.after(this.printed);
      }
      this.printed.width = this.canvas.width; this.printed.height = this.canvas.height;
      if (this.canvas.width) this.printed.getContext("2d").drawImage(this.canvas, 0, 0);
    }

    simplify(on) { // says so where faces are left out
      if (this.isSimple === on) return;
      this.isSimple = on;
      this.root.classList.toggle("tp-fast", on);
      this.coarseNote.hidden = !on || !this.renderer.panes.some((own) => own.coarseCount);
    }

    backdrop(dark) { // the two ends of the gradient behind the canvas, which the style says
      if (!this.shades || this.shades.dark !== dark) {
        const parts = (getComputedStyle(this.stage).backgroundImage.match(/[\d.]+/g) || []).map(Number);
        this.shades = { dark, ends: parts.length === 6 ? [parts.slice(0, 3), parts.slice(3)] : PAPER };
      }
      return this.shades.ends;
    }

    positions(k = 0) { return Array.from(this.renderer.moved(k, this.phase, this.scale(k))); }
  }

  window.toolpointStart = function () {
    for (const root of document.querySelectorAll(".tp-view[data-source]")) {
      if (window.toolpointViews[root.dataset.name]) continue;
      const data = JSON.parse(document.getElementById(root.dataset.source).textContent);
      window.toolpointViews[root.dataset.name] = new View(root, data);
    }
  };
  View.HOME = HOME; View.VIEWS = VIEWS; View.make = make;
  window.ToolpointShapeView = View;
})();
