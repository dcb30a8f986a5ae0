"use strict";
// The path of a program: instanced ribbons by WebGL2, a slider of time, colours by choice, blocks picked, text and lobes beside.
(function () {
  window.toolpointPrograms = window.toolpointPrograms || {};
  const VERTEX = `#version 300 es
precision highp float;
in vec3 a, b; in float level, kind, block;
uniform mat4 matrix; uniform vec2 pixel; uniform float selected, width, rapids; uniform vec3 ramp[10];
out vec3 colour; flat out float hidden;
void main() {
  bool chosen = block == selected;
  vec4 p = matrix * vec4(a, 1.0), q = matrix * vec4(b, 1.0);
  vec2 way = (q.xy / q.w - p.xy / p.w) / pixel;
  float size = length(way);
  vec2 across = size > 0.0 ? vec2(-way.y, way.x) / size : vec2(1.0, 0.0);
  float w = chosen ? 3.0 * width : kind > 1.5 ? width : 0.4 * width;
  vec4 at = (gl_VertexID & 1) == 0 ? p : q;
  at.xy += ((gl_VertexID & 2) == 0 ? 1.0 : -1.0) * across * 0.5 * w * pixel * at.w;
  if (chosen) at.z -= 0.02 * at.w;
  hidden = kind < 1.5 && rapids < 0.5 && !chosen ? 1.0 : 0.0;
  float s = clamp(level, 0.0, 1.0) * 9.0; int k = int(min(floor(s), 8.0));
  colour = chosen ? vec3(0.95, 0.1, 0.75) : kind < 1.5 ? vec3(0.55, 0.6, 0.68) : level < 0.0 ? vec3(0.6)
    : mix(ramp[k], ramp[k + 1], s - float(k));
  gl_Position = at;
}`;
  const FRAGMENT = `#version 300 es
precision highp float;
in vec3 colour; flat in float hidden; out vec4 pixelColour;
void main() { if (hidden > 0.5) discard; pixelColour = vec4(colour, 1.0); }`;
  const WORK_VERTEX = `#version 300 es
precision highp float;
in vec3 place; uniform mat4 matrix; out vec3 seen;
void main() { seen = place; gl_Position = matrix * vec4(place, 1.0); gl_Position.z += 0.002 * gl_Position.w; }`;
  const WORK_FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen; out vec4 pixelColour; uniform vec3 tint;
void main() { vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
  pixelColour = vec4(tint * (0.55 + 0.45 * abs(dot(n, normalize(vec3(0.35, 0.25, 0.9))))), 1.0); }`;
  const FIELD = 0.42, HOME = [-0.95, 0.85], ROW = 20, NEAR_PIXELS = 14, MOVING_PIECES = 20000;

  function make(tag, attributes, ...children) {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {}))
      key === "text" ? node.textContent = value : node.setAttribute(key, value);
    node.append(...children);
    return node;
  }
  function svg(tag, attributes, text) {
    const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    return node;
  }
  function program(gl, vertex, fragment) {
    const made = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  }
  const number = (x, digits) => x === null || !Number.isFinite(x) ? "–" : String(Number(x.toPrecision(digits)));

  class Program {
    constructor(root, data) {
      this.root = root; this.data = data; this.frames = 0; this.selected = -1; this.azimuth = HOME[0]; this.elevation = HOME[1];
      this.zoom = 1; this.pan = [0, 0]; this.rapids = false; this.playing = false;
      this.unpack();
      this.build();
      try { this.start(); } catch (error) { this.refuse(String(error.message || error)); return; }
      this.choose(0); this.showUntil(Infinity);
      new ResizeObserver(() => this.touch()).observe(this.canvas);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.touch());
      window.addEventListener("beforeprint", () => this.render());
    }

    unpack() {
      const d = this.data, read = window.ToolpointData;
      const steps = new Uint16Array(read(d.block)), spans = new Float32Array(read(d.time));
      const raw = new Uint16Array(read(d.points));
      this.points = Float32Array.from(raw, (v, i) => (v / 65535 - 0.5));
      this.count = steps.length; this.block = new Float32Array(this.count);
      for (let i = 0, sum = 0; i < this.count; i++) this.block[i] = sum += steps[i];
      this.blocks = spans.length; this.ends = new Float64Array(this.blocks);
      for (let k = 0, sum = 0; k < this.blocks; k++) this.ends[k] = sum += spans[k];
      this.kind = new Uint8Array(read(d.kind)); this.lines = new Uint32Array(read(d.line)); this.verdict = new Uint8Array(read(d.verdict));
      this.levels = d.quantities.map((q) => q.coarse ? new Uint8Array(read(q.levels)) : new Uint16Array(read(q.levels)));
      this.nodes = Float32Array.from(new Uint16Array(read(d.nodes)), (v) => v / 65535 - 0.5);
      this.triangles = new Uint32Array(read(d.triangles));
      this.first = new Int32Array(this.blocks + 1).fill(-1); this.last = new Int32Array(this.blocks).fill(-1);
      for (let i = 0; i < this.count; i++) { const k = this.block[i]; if (this.first[k] < 0) this.first[k] = i; this.last[k] = i; }
      this.text = d.text ? d.text.split("\n") : [];
      this.blockOfLine = new Map();
      for (let k = this.blocks - 1; k >= 0; k--) if (!this.blockOfLine.has(this.lines[k]) || this.kind[k] > 1) this.blockOfLine.set(this.lines[k], k);
      this.lobesOf = new Map(); d.lobes.forEach((l, i) => l.blocks.forEach((k) => this.lobesOf.set(k, i)));
      const low = [9, 9, 9], high = [-9, -9, -9]; // of what is cut and of the work: retracts may be far
      const widen = (list, i) => { for (let j = 0; j < 3; j++) { low[j] = Math.min(low[j], list[i + j]); high[j] = Math.max(high[j], list[i + j]); } };
      const cuts = this.kind.some((kind) => kind > 1);
      for (let i = 0; i < this.count; i++) if (!cuts || this.kind[this.block[i]] > 1) { widen(this.points, 3 * i); widen(this.points, 3 * i + 3); }
      for (let i = 0; i < this.nodes.length; i += 3) widen(this.nodes, i);
      this.extent = low.map((v, j) => [v, high[j]]);
      this.centre = this.extent.map(([lo, hi]) => (lo + hi) / 2);
      this.radius = Math.hypot(...this.extent.map(([lo, hi]) => hi - lo)) / 2 || 1;
    }

    value(q, k) {
      const level = this.levels[q][k], { end, coarse } = this.data.quantities[q];
      return level === 0 ? null : (level - 1) / (coarse ? 254 : 65534) * end;
    }

    build() {
      const id = this.root.dataset.name;
      this.canvas = make("canvas", { tabindex: "0", role: "img", "aria-label":
        "Path of the program. Drag or arrow keys turn, shift moves, wheel or plus and minus zoom, a click picks a block." });
      this.legend = make("div", { class: "tp-legend" });
      this.stage = make("div", { class: "tp-stage" }, this.canvas, this.legend);
      this.choice = make("select", { id: id + "-colour" });
      this.data.quantities.forEach((q, i) => this.choice.append(make("option", { value: String(i), text: q.name + (q.unit ? ", " + q.unit : "") })));
      this.choice.addEventListener("change", () => this.choose(Number(this.choice.value)));
      this.slider = make("input", { type: "range", min: "0", max: "1000", value: "1000", id: id + "-time" });
      this.clock = make("output", { for: id + "-time" });
      this.slider.addEventListener("input", () => this.showUntil(this.total * this.slider.value / 1000));
      this.button = make("button", { type: "button", text: "Play" });
      this.button.addEventListener("click", () => this.play(!this.playing));
      const tick = make("input", { type: "checkbox" });
      tick.addEventListener("change", () => { this.rapids = tick.checked; this.touch(); });
      this.bar = make("div", { class: "tp-bar" }, this.button,
        make("label", { class: "tp-slider", for: id + "-time" }, "Time", this.slider, this.clock),
        make("label", { class: "tp-select" }, "Colour", this.choice), make("label", { class: "tp-tick" }, tick, "Moves in air"));
      this.details = make("div", { class: "tp-details" }, make("p", { text: "Click a block in the picture or a line of the text." }));
      this.listing = make("div", { class: "tp-listing", tabindex: "0", role: "listbox", "aria-label": "Program" });
      this.sheet = make("div", { class: "tp-sheet" }); this.listing.append(this.sheet);
      this.sheet.style.height = this.text.length * ROW + "px";
      this.listing.addEventListener("scroll", () => this.list());
      this.listing.addEventListener("keydown", (event) => { const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
        if (step) { event.preventDefault(); this.step(step); } });
      const side = make("div", { class: "tp-side" });
      if (this.text.length) side.append(make("h4", { "aria-level": "3", text: "Program" }), this.listing);
      side.append(make("h4", { "aria-level": "3", text: "Block" }), this.details);
      this.root.replaceChildren(make("div", { class: "tp-main" }, this.stage, this.bar), side);
      this.total = this.ends.length ? this.ends[this.ends.length - 1] : 0;
      this.controls();
      this.list();
    }

    refuse(reason) {
      this.failed = reason;
      this.stage.replaceChildren(make("div", { class: "tp-message", role: "alert" }, make("strong", { text: "The path cannot be drawn here." }),
        make("p", { text: "This browser offers no WebGL2 (" + reason + "). The blocks are in the tables and the text." })));
    }

    start() {
      const gl = this.gl = this.canvas.getContext("webgl2", { antialias: false, alpha: true, premultipliedAlpha: true });
      if (!gl) throw new Error("no WebGL2 context");
      this.ribbons = program(gl, VERTEX, FRAGMENT); this.work = program(gl, WORK_VERTEX, WORK_FRAGMENT);
      this.array = gl.createVertexArray(); gl.bindVertexArray(this.array);
      this.attributes = [];
      const filled = (data) => { const buffer = gl.createBuffer(); gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW); return buffer; };
      const attribute = (name, buffer, size, later) => {
        const at = gl.getAttribLocation(this.ribbons, name);
        gl.enableVertexAttribArray(at); gl.vertexAttribDivisor(at, 1); this.attributes.push([buffer, at, size, later]);
      };
      const places = filled(this.points); this.shades = new Float32Array(this.count); this.shadeBuffer = filled(this.shades);
      attribute("a", places, 3, 0); attribute("b", places, 3, 1); attribute("level", this.shadeBuffer, 1, 0);
      attribute("kind", filled(Float32Array.from(this.block, (k) => this.kind[k])), 1, 0); attribute("block", filled(this.block), 1, 0);
      this.workArray = gl.createVertexArray(); gl.bindVertexArray(this.workArray);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ARRAY_BUFFER, this.nodes, gl.STATIC_DRAW);
      const at = gl.getAttribLocation(this.work, "place");
      gl.enableVertexAttribArray(at); gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.triangles, gl.STATIC_DRAW);
      gl.bindVertexArray(null);
    }

    choose(q) {
      this.quantity = q; this.choice.value = String(q);
      const { name, unit, end, digits, coarse } = this.data.quantities[q], top = coarse ? 254 : 65534, levels = this.levels[q];
      for (let i = 0; i < this.count; i++) { const level = levels[this.block[i]]; this.shades[i] = level === 0 ? -1 : (level - 1) / top; }
      this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.shadeBuffer); this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, this.shades);
      const bar = make("i", {}), stops = this.data.ramp.map((c) => "rgb(" + c.map((v) => Math.round(255 * v)).join(" ") + ")");
      bar.style.background = "linear-gradient(90deg," + stops.join(",") + ")";
      this.legend.replaceChildren("0", bar, number(end, digits) + (unit ? " " + unit : ""));
      this.legend.setAttribute("aria-label", name); this.touch();
    }

    showUntil(time) {
      this.until = Math.min(Math.max(time, 0), this.total);
      let low = 0, high = this.blocks; // blocks that begin before it; a part of the last is drawn by its pieces
      while (low < high) { const mid = (low + high) >> 1; this.ends[mid] <= this.until ? low = mid + 1 : high = mid; }
      let pieces = low >= this.blocks ? this.count : 0;
      if (low < this.blocks) {
        let k = low; while (k < this.blocks && this.first[k] < 0) k += 1;
        if (k >= this.blocks) pieces = this.count;
        else {
          const begin = low ? this.ends[low - 1] : 0, share = k === low ? (this.until - begin) / Math.max(this.ends[low] - begin, 1e-12) : 0;
          pieces = this.first[k] + Math.ceil(share * (this.last[k] - this.first[k] + 1));
        }
      }
      this.pieces = pieces;
      this.slider.value = String(Math.round(1000 * this.until / (this.total || 1)));
      this.clock.textContent = number(this.until, 4) + " s";
      this.touch();
    }

    play(on) {
      this.playing = on; this.button.textContent = on ? "Pause" : "Play";
      if (!on) return;
      if (this.until >= this.total) this.showUntil(0);
      let before = null;
      const tick = (now) => {
        if (!this.playing) return;
        if (before !== null) this.showUntil(this.until + this.total * (now - before) / 20000); // the whole in 20 s
        before = now;
        if (this.until >= this.total) { this.play(false); return; }
        requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }

    touch() {
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; this.render(); });
    }

    matrix() {
      const { azimuth, elevation, zoom, pan } = this, aspect = this.canvas.width / this.canvas.height;
      const back = [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];
      const right = [-Math.sin(azimuth), Math.cos(azimuth), 0];
      const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
      const distance = 1.05 * this.radius / Math.sin(FIELD / 2) / Math.min(1, aspect) / zoom;
      const eye = this.centre.map((c, i) => c + distance * back[i] - pan[0] * right[i] - pan[1] * up[i]);
      const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const near = Math.max(distance - 3 * this.radius, 0.02 * distance), far = distance + 4 * this.radius, f = 1 / Math.tan(FIELD / 2);
      const rows = [[...right, -dot(right, eye)].map((v) => v * f / aspect), [...up, -dot(up, eye)].map((v) => v * f),
        [...back, -dot(back, eye)]];
      const depth = rows[2].map((v) => v * (far + near) / (near - far)); depth[3] += 2 * far * near / (near - far);
      this.perPixel = 2 * distance * Math.tan(FIELD / 2) / this.canvas.clientHeight; this.axes = { right, up };
      const out = new Float32Array(16);
      for (let j = 0; j < 4; j++) out.set([rows[0][j], rows[1][j], depth[j], -rows[2][j]], 4 * j);
      return out;
    }

    render() {
      const gl = this.gl;
      if (!gl || !this.canvas.clientWidth) return;
      const moves = this.playing || performance.now() - (this.before || -1e9) < 120; // while it moves speed counts, else sharpness
      this.before = performance.now();
      if (moves) { clearTimeout(this.settling); this.settling = setTimeout(() => { this.before = -1e9; this.touch(); }, 250); }
      const ratio = moves ? 1 : Math.max(Math.min(devicePixelRatio || 1, 2), 2), w = Math.round(this.canvas.clientWidth * ratio), h = Math.round(this.canvas.clientHeight * ratio);
      if (this.canvas.width !== w || this.canvas.height !== h) { this.canvas.width = w; this.canvas.height = h; }
      const matrix = this.view = this.matrix();
      gl.viewport(0, 0, w, h); gl.enable(gl.DEPTH_TEST); gl.depthFunc(gl.LEQUAL); gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const dark = matchMedia("(prefers-color-scheme: dark)").matches && !matchMedia("print").matches;
      if (this.triangles.length) {
        gl.useProgram(this.work); gl.bindVertexArray(this.workArray);
        gl.uniformMatrix4fv(gl.getUniformLocation(this.work, "matrix"), false, matrix);
        gl.uniform3fv(gl.getUniformLocation(this.work, "tint"), dark ? [0.36, 0.4, 0.48] : [0.82, 0.84, 0.88]);
        gl.drawElements(gl.TRIANGLES, this.triangles.length, gl.UNSIGNED_INT, 0);
      }
      gl.useProgram(this.ribbons); gl.bindVertexArray(this.array);
      const at = (name) => gl.getUniformLocation(this.ribbons, name);
      gl.uniformMatrix4fv(at("matrix"), false, matrix); gl.uniform2f(at("pixel"), 2 * ratio / w, 2 * ratio / h);
      gl.uniform1f(at("selected"), this.selected); gl.uniform1f(at("width"), this.count > 30000 ? 2.2 : 3.6);
      gl.uniform1f(at("rapids"), this.rapids ? 1 : 0); gl.uniform3fv(at("ramp"), new Float32Array(this.data.ramp.flat()));
      // While it moves a long path is drawn through every k-th of its points: the strides of the arrays do it.
      const k = moves ? Math.ceil(this.count / MOVING_PIECES) : 1;
      for (const [buffer, place, size, later] of this.attributes) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * size * k, 4 * size * k * later);
      }
      if (this.pieces >= k) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, Math.floor(this.pieces / k));
      this.frames += 1;
    }

    pick(x, y) { // block nearest to a place of the canvas, in pixels; of equals the one in front
      const m = this.view, w = this.canvas.clientWidth, h = this.canvas.clientHeight, p = this.points;
      const project = (i) => { const o = 3 * i, px = p[o], py = p[o + 1], pz = p[o + 2];
        const k = m[3] * px + m[7] * py + m[11] * pz + m[15];
        return [(1 + (m[0] * px + m[4] * py + m[8] * pz + m[12]) / k) * w / 2, (1 - (m[1] * px + m[5] * py + m[9] * pz + m[13]) / k) * h / 2, k]; };
      let best = -1, least = Infinity, a = this.pieces ? project(0) : null;
      for (let i = 0; i < this.pieces; i++) {
        const b = project(i + 1), dx = b[0] - a[0], dy = b[1] - a[1], size = dx * dx + dy * dy;
        const t = size > 0 ? Math.min(Math.max(((x - a[0]) * dx + (y - a[1]) * dy) / size, 0), 1) : 0;
        const gap = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y), cost = gap + 4 * (a[2] + t * (b[2] - a[2])) / this.radius;
        if (gap < NEAR_PIXELS && cost < least && (this.kind[this.block[i]] > 1 || this.rapids)) { least = cost; best = this.block[i]; }
        a = b;
      }
      return best;
    }

    step(direction) {
      let k = this.selected + direction;
      while (k >= 0 && k < this.blocks && this.kind[k] < 2) k += direction;
      if (k >= 0 && k < this.blocks) this.select(k);
    }

    select(k, scroll = true) {
      if (!(k >= 0 && k < this.blocks)) return;
      this.selected = k;
      const rows = [["line", String(this.lines[k])], ["verdict", this.data.verdicts[this.verdict[k]] || ""],
        ["ends at", number(this.ends[k], 4) + " s"],
        ...this.data.quantities.map((q, i) => [q.name, number(this.value(i, k), q.digits) + (this.value(i, k) === null ? "" : " " + q.unit)])];
      const table = make("dl", {});
      for (const [name, value] of rows) table.append(make("dt", { text: name }), make("dd", { text: value }));
      this.details.replaceChildren(table);
      if (this.data.lobes.length) {
        const index = this.lobesOf.get(k);
        this.details.append(index === undefined ? make("p", { text: "No lobes were computed for this block: they are for the engagements nearest to their limit." })
          : this.lobes(this.data.lobes[index], k));
      }
      if (scroll && this.text.length) {
        const top = (this.lines[k] - 1) * ROW, room = this.listing.clientHeight;
        if (top < this.listing.scrollTop || top > this.listing.scrollTop + room - ROW) this.listing.scrollTop = Math.max(top - room / 2, 0);
      }
      this.list(); this.touch();
    }

    lobes(data) { // stable depth over speed, with the block's own cut
      const w = 300, h = 190, left = 44, bottom = 36, right = 10, top = 10;
      const known = data.limit.map((v) => v === null ? null : v), high = 1.15 * Math.max(data.depth, ...known.filter((v) => v !== null), 1e-6);
      const lowSpeed = data.speed[0], highSpeed = data.speed.at(-1);
      const X = (s) => left + (s - lowSpeed) / (highSpeed - lowSpeed || 1) * (w - left - right), Y = (d) => h - bottom - d / high * (h - top - bottom);
      const box = svg("svg", { viewBox: `0 0 ${w} ${h}`, class: "tp-lobes", role: "img", "aria-label": "Stable depth over spindle speed" });
      for (const share of [0, 0.5, 1]) {
        const d = share * high / 1.15, s = lowSpeed + share * (highSpeed - lowSpeed);
        box.append(svg("line", { x1: left, x2: w - right, y1: Y(d), y2: Y(d), class: "grid" }),
          svg("text", { x: left - 5, y: Y(d) + 4, "text-anchor": "end" }, number(d, 3)),
          svg("text", { x: X(s), y: h - bottom + 15, "text-anchor": share ? share < 1 ? "middle" : "end" : "start" }, number(s, 4)));
      }
      let path = "", pen = false;
      known.forEach((d, i) => { if (d === null) { pen = false; return; } path += (pen ? "L" : "M") + X(data.speed[i]).toFixed(1) + " " + Y(d).toFixed(1); pen = true; });
      box.append(svg("path", { d: path, class: "limit" }), svg("circle", { cx: X(data.now), cy: Y(data.depth), r: 5, class: "cut" }),
        svg("text", { x: (left + w - right) / 2, y: h - 4, "text-anchor": "middle" }, "rev/min"),
        svg("text", { x: 12, y: (h - bottom + top) / 2, transform: `rotate(-90 12 ${(h - bottom + top) / 2})`, "text-anchor": "middle" }, "stable depth, mm"));
      return make("div", {}, box, make("p", { class: "key", text: "Dot: the deepest cut of this engagement. Above the curve it chatters; no curve: no limit within four times the depth." }));
    }

    list() { // only the lines in sight are in the document
      const from = Math.max(Math.floor(this.listing.scrollTop / ROW) - 8, 0), to = Math.min(from + Math.ceil((this.listing.clientHeight || 320) / ROW) + 16, this.text.length);
      const mine = this.selected >= 0 ? this.lines[this.selected] : -1, rows = [];
      for (let i = from; i < to; i++) {
        const k = this.blockOfLine.get(i + 1), verdict = k === undefined || this.kind[k] < 2 ? "" : this.data.verdicts[this.verdict[k]];
        const row = make("div", { class: "tp-line" + (verdict === "chatters" ? " bad" : ""), role: "option", "aria-selected": String(i + 1 === mine) },
          make("span", { text: String(i + 1) }), make("code", { text: this.text[i] }));
        row.style.top = i * ROW + "px";
        if (k !== undefined) row.addEventListener("click", () => this.select(k, false));
        rows.push(row);
      }
      this.sheet.replaceChildren(...rows);
    }

    controls() {
      const c = this.canvas; let held = null;
      c.addEventListener("pointerdown", (e) => { held = { x: e.clientX, y: e.clientY, moved: 0 }; c.setPointerCapture(e.pointerId); });
      c.addEventListener("pointermove", (e) => {
        if (!held) return;
        const dx = e.clientX - held.x, dy = e.clientY - held.y;
        held.moved += Math.abs(dx) + Math.abs(dy); held.x = e.clientX; held.y = e.clientY;
        if (held.moved > 4) this.turn(dx, dy, e.shiftKey || e.buttons === 2);
      });
      c.addEventListener("pointerup", (e) => {
        if (held && held.moved <= 4) { const r = c.getBoundingClientRect(); const k = this.pick(e.clientX - r.left, e.clientY - r.top); if (k >= 0) this.select(k); }
        held = null;
      });
      c.addEventListener("contextmenu", (e) => e.preventDefault());
      c.addEventListener("wheel", (e) => { e.preventDefault(); this.zoomed(Math.exp(-0.0015 * e.deltaY)); }, { passive: false });
      c.addEventListener("keydown", (e) => {
        const way = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[e.key];
        if (way) this.turn(way[0], way[1], e.shiftKey); else if (e.key === "+") this.zoomed(1.2); else if (e.key === "-") this.zoomed(1 / 1.2); else return;
        e.preventDefault();
      });
    }

    turn(dx, dy, moves) {
      if (moves) { this.pan[0] += dx * this.perPixel; this.pan[1] -= dy * this.perPixel; }
      else { this.azimuth -= 0.008 * dx; this.elevation = Math.min(Math.max(this.elevation + 0.008 * dy, -1.57), 1.57); }
      this.touch();
    }

    zoomed(factor) { this.zoom = Math.min(Math.max(this.zoom * factor, 0.3), 60); this.touch(); }
  }

  for (const root of document.querySelectorAll(".tp-program[data-source]")) {
    const data = JSON.parse(window.ToolpointText(root.dataset.source));
    window.toolpointPrograms[root.dataset.name] = new Program(root, data);
  }
})();
