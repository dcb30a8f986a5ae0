"use strict";
// Controls of a shape view: pointer, touch and keys on the canvas, the bar below it, the side panel, axes and legend.
window.ToolpointControls = (function () {
  const say = (text) => (window.ToolpointSay ? window.ToolpointSay(text) : text); // a page around it may have words of its own
  const SVG = "http://www.w3.org/2000/svg";
  const make = (...all) => window.ToolpointShapeView.make(...all);

  function turn(view, dx, dy) {
    view.camera.azimuth -= dx * 0.008;
    view.camera.elevation = Math.max(-1.569, Math.min(1.569, view.camera.elevation + dy * 0.008));
    view.touch();
  }
  function pan(view, dx, dy) {
    view.camera.pan[0] += dx * view.perPixel; view.camera.pan[1] -= dy * view.perPixel; view.touch();
  }
  function zoom(view, factor) {
    view.camera.zoom = Math.max(0.2, Math.min(40, view.camera.zoom * factor)); view.touch();
  }
  function home(view, angles) {
    const start = window.ToolpointShapeView.HOME;
    view.camera = { ...start, pan: [0, 0], azimuth: angles ? angles[0] : start.azimuth,
      elevation: angles ? angles[1] : start.elevation };
    view.touch();
  }

  function pointer(view) {
    const held = new Map(), canvas = view.canvas;
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, [e.clientX, e.clientY]);
      canvas.focus({ preventScroll: true });
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (e) => held.delete(e.pointerId));
    canvas.addEventListener("pointermove", (e) => {
      const was = held.get(e.pointerId);
      if (!was) return;
      const dx = e.clientX - was[0], dy = e.clientY - was[1];
      const other = [...held].find(([id]) => id !== e.pointerId);
      if (other) { // two fingers: pinch and move
        const far = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
        zoom(view, far([e.clientX, e.clientY]) / Math.max(far(was), 1)); pan(view, dx / 2, dy / 2);
      } else if (e.shiftKey || e.ctrlKey || (e.buttons & 6)) pan(view, dx, dy);
      else turn(view, dx, dy);
      held.set(e.pointerId, [e.clientX, e.clientY]);
    });
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(view, Math.exp(-e.deltaY * 0.0012)); },
      { passive: false });
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("dblclick", () => home(view));
  }

  function keys(view) {
    const step = (d) => view.showMode((view.mode + d + view.buttons.length) % view.buttons.length);
    const moves = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] };
    view.canvas.addEventListener("keydown", (e) => {
      if (e.ctrlKey || e.metaKey || e.altKey) return;
      if (moves[e.key]) e.shiftKey ? pan(view, ...moves[e.key]) : turn(view, ...moves[e.key]);
      else if (e.key === "+" || e.key === "=") zoom(view, 1.15);
      else if (e.key === "-") zoom(view, 1 / 1.15);
      else if (e.key === " ") view.play(!view.playing);
      else if (e.key === "n") step(1);
      else if (e.key === "p") step(-1);
      else if (e.key === "Home" || e.key === "0") home(view);
      else if (/^[1-9]$/.test(e.key) && Number(e.key) <= view.buttons.length) view.showMode(Number(e.key) - 1);
      else return;
      e.preventDefault();
    });
  }

  function slider(label, low, high, step, act) {
    const input = make("input", { type: "range", min: low, max: high, step });
    const value = make("output", {});
    input.addEventListener("input", () => act(Number(input.value)));
    return { input, value, node: make("label", { class: "tp-slider" }, make("span", { text: label }), input, value) };
  }

  function bar(view) {
    const play = make("button", { type: "button", class: "tp-play" });
    play.addEventListener("click", () => view.play(!view.playing));
    const phase = slider(say("Phase"), 0, 360, 1, (v) => view.setPhase(v * Math.PI / 180));
    const size = slider(say("Amplitude"), 0, 4, 0.05, (v) => view.setAmplitude(v));
    view.bar.append(play, phase.node, size.node);
    view.refresh = () => {
      const degrees = Math.round(view.phase * 180 / Math.PI) % 360;
      const word = say(view.playing ? "Pause" : "Play");
      if (play.textContent !== word) { play.textContent = word; play.setAttribute("aria-pressed", String(view.playing)); }
      phase.input.value = degrees; phase.value.textContent = degrees + "°";
      size.input.value = view.amplitude; size.value.textContent = "×" + view.amplitude.toFixed(2).replace(/\.?0+$/, "");
    };
    view.refresh();
  }

  function tick(text, on, act) {
    const box = make("input", { type: "checkbox" });
    box.checked = on;
    box.addEventListener("change", () => act(box.checked));
    return make("label", { class: "tp-tick" }, box, make("span", { text }));
  }

  function side(view) {
    const looks = make("div", { class: "tp-looks", role: "group", "aria-label": say("Direction of view") });
    for (const [name, angles] of Object.entries(window.ToolpointShapeView.VIEWS)) {
      const button = make("button", { type: "button", text: say(name) });
      button.addEventListener("click", () => home(view, angles));
      looks.append(button);
    }
    const select = make("select", { "aria-label": say("Colour") });
    ["amplitude", "momentary displacement", "body"].forEach((name, i) => select.append(make("option", { value: i, text: say(name) })));
    select.addEventListener("change", () => {
      view.colouring = Number(select.value); view.legend.hidden = view.colouring === 2; view.touch();
    });
    if (view.still) { view.side.append(make("h4", { "aria-level": "3", text: say("View") }), looks); return; }
    view.side.append(make("h4", { "aria-level": "3", text: say("View") }), looks,
      make("label", { class: "tp-select" }, make("span", { text: say("Colour") }), select),
      tick(say("Undeformed outline"), view.ghost, (on) => { view.ghost = on; view.touch(); }));
    const names = [...new Set(view.panes.flatMap((pane) => pane.bodies))];
    if (names.length < 2) return;
    const list = make("div", { class: "tp-bodies", role: "group", "aria-label": say("Bodies shown") });
    for (const name of names) list.append(tick(name, true, (on) => {
      on ? view.hidden.delete(name) : view.hidden.add(name);
      view.panes.forEach((_, k) => view.elements(k)); view.touch();
    }));
    view.bar.after(make("div", { class: "tp-below" }, make("h4", { "aria-level": "3", text: say("Bodies") }), list));
  }

  function overlays(view) {
    view.panes.forEach((pane, k) => {
      pane.caption = make("div", { class: "tp-caption", "aria-live": "polite" });
      pane.caption.style.left = `calc(${100 * k / view.panes.length}% + 12px)`;
      pane.caption.style.maxWidth = `calc(${100 / view.panes.length}% - 24px)`;
      view.stage.append(pane.caption);
    });
    const ramp = view.data.ramp.map((c) => `rgb(${c.map((v) => Math.round(255 * v)).join(" ")})`);
    const strip = make("i", {});
    strip.style.background = `linear-gradient(to right, ${ramp.join(", ")})`;
    const ends = view.still ? [view.still[0], view.still[1] + " " + view.still[2]] : ["0", say("1 (of the largest motion)")];
    view.legend = make("div", { class: "tp-legend" }, make("span", { text: ends[0] }), strip, make("span", { text: ends[1] }));
    view.stage.append(view.legend);
    if (view.panes.some((pane) => pane.known.includes(0)))
      view.legend.append(make("i", { class: "tp-grey" }), make("span", { text: say("no data") }));
    view.drawAxes = axes(view);
  }

  function axes(view) {
    const svg = document.createElementNS(SVG, "svg"), parts = [];
    svg.setAttribute("class", "tp-axes"); svg.setAttribute("viewBox", "-40 -40 80 80"); svg.setAttribute("aria-hidden", "true");
    ["X", "Y", "Z"].forEach((name, i) => {
      const line = document.createElementNS(SVG, "line"), text = document.createElementNS(SVG, "text");
      line.setAttribute("stroke", ["#d55e00", "#009e73", "#3b8fd6"][i]); text.textContent = name;
      svg.append(line, text); parts.push([line, text]);
    });
    view.stage.append(svg);
    let drawn = "";
    return () => {
      const { azimuth, elevation } = view.camera, now = azimuth + " " + elevation;
      if (now === drawn) return;
      drawn = now;
      parts.forEach(([line, text], i) => place(line, text, 26 * view.axes.right[i], -26 * view.axes.up[i]));
    };
  }

  function place(line, text, x, y) {
    line.setAttribute("x2", x); line.setAttribute("y2", y);
    text.setAttribute("x", x * 1.3); text.setAttribute("y", y * 1.3);
  }

  return function (view) { overlays(view); pointer(view); keys(view); side(view); view.still ? view.bar.remove() : bar(view); };
})();
