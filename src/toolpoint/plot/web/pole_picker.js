"use strict";
// Poles added and modes removed by a click; the command and the choice file that bring the same again.
(function () {
  const make = (tag, attributes, ...children) => {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {})) key === "text" ? node.textContent = value : node.setAttribute(key, value);
    node.append(...children);
    return node;
  };
  const short = (v) => String(Number(v.toPrecision(6)));

  class Picker {
    constructor(root, data) {
      this.root = root; this.data = data;
      this.added = data.added.map((p) => ({ ...p })); this.removed = [...data.removed];
      this.lists = make("div", {}); this.command = make("pre", { tabindex: "0", class: "tp-copy", "aria-label": "Command" });
      this.file = make("pre", { tabindex: "0", class: "tp-copy", "aria-label": "Choice file" });
      this.said = make("p", { "aria-live": "polite" });
      const undo = make("button", { type: "button", text: "As it was" });
      undo.addEventListener("click", () => { this.added = data.added.map((p) => ({ ...p })); this.removed = [...data.removed]; this.show("As it was."); });
      root.replaceChildren(this.lists, this.said, undo, make("h4", { "aria-level": "3", text: "The command" }), this.command,
        make("h4", { "aria-level": "3", text: "or, with --choice choice.yaml, this file" }), this.file);
      this.show("");
    }

    toggle(f, word) {
      const at = this.removed.findIndex((g) => Math.abs(g - f) < 1e-6 * f);
      if (at >= 0) this.removed.splice(at, 1); else this.removed.push(f);
      this.show(`${short(f)} Hz ${at >= 0 ? "stays" : "goes"}${word || "."}`);
    }

    add(f, z) {
      const near = this.added.findIndex((p) => Math.abs(p.f - f) < 0.2 * p.z * p.f);
      if (near >= 0) { this.added.splice(near, 1); this.show(`${short(f)} Hz is not added any more.`); return; }
      const taken = this.data.modes.find((m) => Math.abs(m.f - f) < 0.2 * m.z * m.f && !this.removed.includes(m.f));
      if (taken) { this.show(`${short(f)} Hz is a mode already.`); return; }
      this.added.push({ f: Number(short(f)), z: Number(short(z)) });
      this.show(`${short(f)} Hz with ${short(100 * z)} % is added.`);
    }

    clicked(event) {
      const point = event.points[0], data = point.customdata;
      if (!Array.isArray(data)) return;
      if (data[0] === "mode") this.toggle(this.data.modes[data[1]].f);
      else if (data[1] > 0) this.add(point.x, data[1] / 100);
    }

    tick(text, on, act) {
      const box = make("input", { type: "checkbox" });
      box.checked = on;
      box.addEventListener("change", act);
      return make("label", { class: "tp-tick" }, box, make("span", { text }));
    }

    show(words) {
      const modes = this.data.modes.map((m) => this.tick(`${short(m.f)} Hz, ${short(100 * m.z)} %`, !this.removed.includes(m.f), () => this.toggle(m.f)));
      const gone = this.removed.filter((f) => !this.data.modes.some((m) => m.f === f))
        .map((f) => this.tick(`${short(f)} Hz (removed before)`, false, () => this.toggle(f)));
      const added = this.added.map((p) => this.tick(`${short(p.f)} Hz, ${short(100 * p.z)} % (added)`, true, () => this.add(p.f, p.z)));
      this.lists.replaceChildren(make("div", { class: "tp-bodies", role: "group", "aria-label": "Modes that are kept" }, ...modes, ...gone, ...added));
      this.said.textContent = words;
      const options = [...this.added.map((p) => `--add ${short(p.f)},${short(100 * p.z)}`), ...this.removed.map((f) => `--remove ${short(f)}`)];
      this.command.textContent = [this.data.command, ...options].join(" ");
      const lines = ["toolpoint: 1"];
      if (this.added.length) lines.push("add:", ...this.added.map((p) => `  - {frequency: ${short(p.f)} Hz, damping_ratio: ${short(p.z)}}`));
      if (this.removed.length) lines.push("remove:", ...this.removed.map((f) => `  - ${short(f)} Hz`));
      this.file.textContent = options.length ? lines.join("\n") : "# nothing is changed yet";
      // The workbench shows this page in a frame: it is told of a choice, and offers to keep it.
      if (window.parent !== window) window.parent.postMessage({ toolpointChoice: options.length ? lines.join("\n") + "\n" : "" }, "*");
    }
  }

  window.toolpointPickers = {};
  window.toolpointPick = function () { // called when the charts are drawn
    for (const root of document.querySelectorAll(".tp-picker[data-source]")) {
      const data = JSON.parse(window.ToolpointText(root.dataset.source)), chart = window.toolpointCharts[data.chart];
      if (!window.toolpointPickers[data.chart]) window.toolpointPickers[data.chart] = new Picker(root, data);
      if (chart && !root.dataset.tied) { root.dataset.tied = "1"; chart.on("plotly_click", (event) => window.toolpointPickers[data.chart].clicked(event)); }
    }
  };
})();
