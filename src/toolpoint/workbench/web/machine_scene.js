"use strict";
// The existing shape view, fed by the server: other nodes at another pose, another shape of the same mode, its list of modes.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  W.MachineScene = class {
    constructor(scene, onmode) {
      this.node = W.make("div", { class: "tp-view", "data-name": "machine" });
      this.view = new window.ToolpointShapeView(this.node, scene);
      this.onmode = onmode;
      this.scene = scene;
      this.last = null;
      const view = this.view;
      view.showMode = (mode) => { // the shapes of the page are those of the server, never kept ones
        view.mode = mode;
        view.buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(i === mode)));
        onmode(mode);
      };
    }

    // Joints as boxes, coloured by a number each from zero to the largest; grey where it is null. No values: as it was.
    // Bodies are outlines meanwhile: joints lie inside them.
    colourJoints(marks, values) {
      const view = this.view, pane = view.panes[0], gl = view.renderer && view.renderer.gl, isOn = values !== null;
      if (!gl) return;
      const tint = Float32Array.from(pane.tint), ramp = this.scene.ramp;
      const most = isOn ? Math.max(...Object.values(values).filter((value) => value !== null), 1e-9) : 1;
      view.elements(0);
      if (isOn) {
        const first = Math.min(pane.count, ...Object.values(marks)), faces = [];
        for (let i = 0; i < pane.triangles.length; i += 3) if (pane.triangles[i] >= first) faces.push(...pane.triangles.subarray(i, i + 3));
        view.renderer.setElements(0, Uint32Array.from(faces), pane.lines, new Uint32Array(0), new Uint32Array(0));
        for (const [joint, start] of Object.entries(marks)) {
          const value = values[joint] ?? null;
          const colour = value === null ? [0.4, 0.4, 0.4] : ramp[Math.round((ramp.length - 1) * value / most)];
          for (let i = start; i < start + 8; i++) colour.forEach((c, j) => { tint[4 * i + j] = c; });
        }
      }
      gl.bindBuffer(gl.ARRAY_BUFFER, view.renderer.panes[0].buffers[3]);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, tint);
      view.colouring = isOn ? 2 : 0;
      view.legend.hidden = isOn;
      view.touch();
    }

    // While something is moved the mode stands still, drawn without smoothing: a frame of it would come before the answer's.
    hold() {
      const view = this.view;
      if (view.playing) { view.playing = false; this.wasPlaying = true; }
      view.isHeld = true;
      clearTimeout(this.timer);
      this.timer = setTimeout(() => { view.isHeld = false; view.touch(); if (this.wasPlaying) { this.wasPlaying = false; view.play(true); } }, 700);
    }

    update({ nodes, shape, mode, frequency_hz: frequency, damping_ratio: damping }) {
      const view = this.view, pane = view.panes[0], places = W.floats(nodes), moved = W.floats(shape);
      if (places.length === pane.nodes.length && view.renderer) {
        pane.nodes.set(places);
        view.renderer.setNodes(0, places);
      }
      view.buttons.forEach((button, i) => {
        if (frequency[i] === undefined) return;
        button.querySelector(".tp-f").textContent = W.hertz(frequency[i]);
        button.querySelector(".tp-z").textContent = "ζ " + (100 * damping[i]).toFixed(2) + " %";
      });
      if (moved.length !== pane.nodes.length) return;
      // A mode has no sign of its own: that of the last shape is kept, so that it does not jump.
      let product = 0;
      if (this.last && this.mode === mode) for (let i = 0; i < moved.length; i++) product += moved[i] * this.last[i];
      if (product < 0) for (let i = 0; i < moved.length; i++) moved[i] = -moved[i];
      this.last = moved; this.mode = mode;
      view.load(0, { real: moved, imaginary: new Float32Array(moved.length) },
        `${W.word("mode")} ${mode + 1}, ${W.hertz(frequency[mode])}, ζ ${(100 * damping[mode]).toFixed(2)} %`);
    }
  };
  W.hertz = (f) => (f >= 1000 ? f.toFixed(0) : f >= 100 ? f.toFixed(1) : f.toFixed(2)) + " Hz";
})(window.Workbench);
