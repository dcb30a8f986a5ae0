"use strict";
// View of joints and machine: move a spring or an axis, and see modes, responses and the limit follow; undo; save as.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const FACTOR = 8; // a spring's slider reaches from an eighth to eight times its saved value

  // What differs from the saved machine; kept by the browser, so a reload and a second tab go on with it.
  class Draft {
    constructor(name, digest) {
      this.key = `toolpoint-machine-${name}`;
      this.past = [];
      const kept = JSON.parse(localStorage.getItem(this.key) || "null");
      this.state = kept && kept.digest === digest ? kept : { digest, values: {}, pose: {}, mode: 0, speed: null, cut: "" };
      this.isOther = Boolean(kept && kept.digest !== digest && Object.keys(kept.values).length);
    }
    change(edit, isNew = true) {
      if (isNew) { this.past.push(JSON.stringify(this.state)); if (this.past.length > 200) this.past.shift(); }
      edit(this.state);
      localStorage.setItem(this.key, JSON.stringify(this.state));
    }
    undo() {
      if (!this.past.length) return false;
      this.state = JSON.parse(this.past.pop());
      localStorage.setItem(this.key, JSON.stringify(this.state));
      return true;
    }
  }

  const SCALES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""]];
  function withUnit(value, way) {
    const isTurning = way.startsWith("r");
    if (!isTurning) return `${W.number(value / 1e6, 4)} N/µm`;
    const [size, prefix] = SCALES.find(([limit]) => value >= limit) || [1, ""];
    return `${W.number(value / size, 4)} ${prefix}N·m/rad`;
  }
  const typed = (text) => text.replace("GN·m", "GN*m").replace("MN·m", "MN*m").replace("kN·m", "kN*m").replace("N·m", "N*m");

  function sliderRow({ id, label, hint, low, high, value, show, path, onmove, onhold }) {
    const slider = W.make("input", { type: "range", id, min: low, max: high, step: (high - low) / 400, value, "aria-label": label });
    const field = W.make("input", { type: "text", class: "wb-value", inputmode: "text", "aria-label": `${label}, ${W.word("with.unit")}`, value: show(value) });
    const fault = W.make("span", { class: "wb-fault", role: "alert" });
    let isHeld = false;
    const write = (v) => { field.value = show(v); W.sayValue(slider, field.value); };
    write(value);
    slider.addEventListener("input", () => { if (!isHeld) { onhold(); isHeld = true; } write(Number(slider.value)); onmove(Number(slider.value)); });
    slider.addEventListener("change", () => { isHeld = false; });
    field.addEventListener("change", async () => {
      fault.textContent = "";
      try {
        const { value: si } = await W.ask("machine/number", { text: typed(field.value), path });
        onhold();
        row.put(row.back(si));
        onmove(row.back(si));
      } catch (error) { fault.textContent = error.message; }
    });
    const row = W.make("div", { class: "wb-slider" }, W.make("label", { for: id, text: label }), hint, slider, field, fault);
    row.back = (si) => si;
    row.put = (v) => { slider.value = v; write(v); };
    return row;
  }

  function springRow(spring, draft, send) {
    const value = draft.state.values[spring.path] ?? spring.value;
    const sure = spring.half_width === null ? W.word("sure.not") : `± ${W.number(100 * spring.half_width, 2)} %`;
    const hint = W.make("span", { class: "wb-hint" }, W.make("i", { class: "wb-soft", style: `--share:${Math.max(0, spring.share || 0)}` }),
      spring.share === null ? "" : W.word("share", { n: Math.round(100 * spring.share) }) + ", ", sure);
    const row = sliderRow({ id: "k-" + spring.path, label: `${spring.joint} ${spring.way}`, hint, low: -Math.log2(FACTOR), high: Math.log2(FACTOR),
      value: Math.log2(value / spring.value), show: (v) => withUnit(spring.value * 2 ** v, spring.way), path: spring.path,
      onhold: () => draft.change(() => {}), onmove: (v) => {
        draft.change((state) => {
          if (Math.abs(v) < 1e-9) delete state.values[spring.path]; else state.values[spring.path] = spring.value * 2 ** v;
        }, false);
        send();
      } });
    row.back = (si) => Math.log2(si / spring.value);
    row.sync = () => row.put(Math.log2((draft.state.values[spring.path] ?? spring.value) / spring.value));
    return row;
  }

  function axisRow(axis, draft, send) {
    const show = (v) => axis.turns ? `${W.number(v * 180 / Math.PI, 4)} deg` : `${W.number(1e3 * v, 4)} mm`;
    const row = sliderRow({ id: "axis-" + axis.name, label: `${W.word("axis")} ${axis.name}`, hint: W.make("span"), low: axis.lower, high: axis.upper,
      value: draft.state.pose[axis.name] ?? axis.at, show, path: "axis " + axis.name, onhold: () => draft.change(() => {}),
      onmove: (v) => { draft.change((state) => { state.pose[axis.name] = v; }, false); send(); } });
    row.sync = () => row.put(draft.state.pose[axis.name] ?? axis.at);
    return row;
  }

  function changes(view, draft, act) {
    const box = W.make("div", { class: "wb-changes", "aria-live": "polite" });
    box.refresh = () => {
      const springs = view.data.springs.filter((spring) => spring.path in draft.state.values);
      const rows = springs.map((spring) => {
        const now = draft.state.values[spring.path], share = 100 * (now / spring.value - 1);
        return [`${spring.joint} ${spring.way}`, withUnit(spring.value, spring.way), withUnit(now, spring.way), `${share > 0 ? "+" : ""}${W.number(share, 3)} %`,
          W.make("button", { type: "button", text: W.word("take.back"), onclick: () => act(() => draft.change((state) => { delete state.values[spring.path]; })) })];
      });
      for (const axis of view.data.axes) {
        const now = draft.state.pose[axis.name];
        if (now !== undefined && Math.abs(now - axis.at) > 1e-12) rows.push([`${W.word("axis")} ${axis.name}`, W.number(axis.at), W.number(now), "",
          W.make("button", { type: "button", text: W.word("take.back"), onclick: () => act(() => draft.change((state) => { delete state.pose[axis.name]; })) })]);
      }
      box.replaceChildren(rows.length ? W.table([W.word("what"), W.word("saved"), W.word("here"), W.word("change"), ""], rows)
        : W.make("p", { class: "key", text: W.word("no.change") }));
    };
    return box;
  }

  function saver(draft, isExport) {
    if (isExport) return W.make("span");
    const name = W.make("input", { type: "text", id: "wb-save-name", value: "changed", maxlength: "60" }), said = W.make("span", { role: "status" });
    const save = W.make("button", { type: "button", text: W.word("save.as"), onclick: async () => {
      try { said.textContent = W.word("written", { file: (await W.ask("machine/save", { name: name.value, values: draft.state.values })).file }); said.className = "key"; }
      catch (error) { said.textContent = error.message; said.className = "wb-fault"; }
    } });
    return W.make("div", { class: "wb-run" }, W.make("label", { for: "wb-save-name", text: W.word("file.name") }), name, save, said);
  }

  W.Draft = Draft;
  W.machineParts = { withUnit, springRow, axisRow, changes, saver, sliderRow };
})(window.Workbench);
