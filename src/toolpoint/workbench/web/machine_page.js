"use strict";
// Page of joints and machine: scene, responses and the limit beside the sliders.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const WAYS = ["x", "y", "z"];
  const MOVING = 250; // ms between two moves of a slider that is on its way

  function responseChart(view) {
    const chart = new W.LineChart({ x: "Hz", y: "µm/N", logX: true, logY: true, height: 300, label: W.word("responses") });
    const micro = (text) => W.floats(text).map((v) => 1e6 * v), lines = view.data.lines_hz;
    const saved = view.data.response && Object.fromEntries(WAYS.map((way) => [way, micro(view.data.response[way])]));
    chart.show = (response, isChanged) => chart.set({ lines: [
      ...(isChanged ? WAYS.map((way) => ({ x: lines, y: saved[way], kind: `saved ${way}`, name: way === "x" ? W.word("saved.state") : "" })) : []),
      ...WAYS.map((way) => ({ x: lines, y: micro(response[way]), kind: way, name: way }))] });
    return chart;
  }

  // Joints coloured by their share of the tool's compliance, or by uncertainty (half width of their widest spring).
  function jointColours(data, scene) {
    const joints = {};
    for (const spring of data.springs) {
      const joint = joints[spring.joint] = joints[spring.joint] || { share: 0, width: null };
      joint.share += Math.max(0, spring.share || 0);
      if (spring.half_width !== null) joint.width = Math.max(joint.width || 0, spring.half_width);
    }
    const entries = Object.entries(joints), percent = (v) => `${W.number(100 * v, 2)} %`;
    const words = W.make("span", { "aria-live": "polite" });
    const choice = W.make("select", { id: "wb-joints", onchange: () => {
      const isSure = choice.value === "sure";
      const values = Object.fromEntries(entries.map(([name, joint]) => [name, isSure ? joint.width : joint.share > 0 || joint.width !== null ? joint.share : null]));
      scene.colourJoints(data.marks, choice.value === "none" ? null : values);
      words.textContent = choice.value === "none" ? "" : W.word("colour." + choice.value) + " " + Object.entries(values).sort((a, b) => (b[1] ?? -1) - (a[1] ?? -1))
        .map(([name, value]) => `${name} ${value === null ? W.word("sure.not") : (isSure ? "± " : "") + percent(value)}`).join(", ");
    } }, ["none", "soft", "sure"].map((value) => W.make("option", { value, text: W.word("colour.by." + value) })));
    return W.make("div", { class: "wb-run" }, W.make("label", { for: "wb-joints", text: W.word("colour.joints") }), choice, W.make("span", { class: "key" }, words));
  }

  function limitWords(limit, isChanged) {
    if (!limit) return "";
    if (!limit.is_exact) return W.word("limit.moving", { speed: Math.round(limit.speed_rpm), depth: limit.limit_m === null ? `> ${W.number(1e3 * limit.searched_m, 2)} mm` : `${W.number(1e3 * limit.limit_m, 2)} mm` });
    const depth = limit.limit_m === null ? `> ${W.number(1e3 * limit.searched_m, 3)} mm` : `${W.number(1e3 * limit.limit_m, 3)} mm`;
    const heard = limit.chatter_hz ? W.word("chatter.at", { f: W.number(limit.chatter_hz, 4) }) : "";
    return W.word(isChanged ? "limit.changed" : "limit.saved", { speed: Math.round(limit.speed_rpm), depth }) + heard;
  }

  W.views.machine = {
    title: () => W.word("view.machine"),
    show(place, view) {
      const parts = W.machineParts, data = view.data, draft = this.draft = new W.Draft(data.file, data.digest);
      if (draft.state.speed === null && data.cuts.length) draft.state.speed = data.cuts[0].speed_rpm;
      const same = W.same(view), words = W.make("p", { class: "wb-limit", "aria-live": "polite" }), live = W.make("div");
      const scene = new W.MachineScene(data.scene, (mode) => { draft.change((state) => { state.mode = mode; }, false); send(); });
      const chart = data.response ? responseChart(view) : null;
      const lobes = new W.LineChart({ x: W.word("speed"), y: W.word("depth"), height: 280, label: W.word("lobes"),
        onpick: (speed) => { draft.change((state) => { state.speed = Math.round(speed); }); send(); } });
      const isChanged = () => Object.keys(draft.state.values).length > 0;
      const show = (answer) => {
        if (place.firstChild !== top) return;
        if (answer.digest !== data.digest) { W.open(true); return; } // the file has changed on the disk: no number of the two mixed
        scene.update(answer);
        const moved = isChanged() || data.axes.some((axis) => (draft.state.pose[axis.name] ?? axis.at) !== axis.at);
        if (chart && answer.response) chart.show(answer.response, moved);
        words.textContent = limitWords(answer.limit, moved);
        if (answer.limit && answer.limit.quick) {
          const quick = answer.limit.quick;
          lobes.set({ lines: [{ x: W.floats(quick.speeds), y: W.floats(quick.limit).map((v) => 1e3 * v), kind: "quick", name: W.word("quick") }],
            marks: [{ x: answer.limit.speed_rpm, y: 1e3 * (answer.limit.limit_m ?? answer.limit.searched_m), 
              kind: answer.limit.limit_m === null ? "above" : answer.limit.is_exact ? "exact" : "", name: W.word(answer.limit.limit_m === null ? "no.limit" : answer.limit.is_exact ? "exact.here" : "quick") }] });
        }
        live.replaceChildren(W.doubts(W.newDoubts(view, answer.doubts)));
        W.fillSame(same, answer.commands, answer.calls);
        W.last = answer; W.moves = (W.moves || 0) + 1;
        fault.replaceChildren();
      };
      const fault = W.make("div");
      const ask = W.latest((body) => W.ask("machine/look", body), show, (error) => fault.replaceChildren(W.fault(error)));
      // A slider on its way asks for the quick limit; the exact one comes when it rests, and after a single move at once.
      let sent = -Infinity, restTimer = 0;
      const go = () => { const now = performance.now(), isMoving = now - sent < MOVING; sent = now; clearTimeout(restTimer);
        if (isMoving && !W.isExport) restTimer = setTimeout(() => { if (place.firstChild === top) ask({ ...draft.state }); }, MOVING);
        ask({ ...draft.state, is_moving: isMoving }); };
      const send = () => { scene.hold(); list.refresh(); if (map) map.refresh(); undo.disabled = !draft.past.length; go(); };
      const axesCount = data.axes.length, rows = [...data.axes.map((axis) => parts.axisRow(axis, draft, send)), ...[...data.springs].sort((a, b) => (b.share || 0) - (a.share || 0)).map((spring) => parts.springRow(spring, draft, send))];
      const sync = (edit) => { if (edit) edit(); rows.forEach((row) => row.sync()); send(); };
      const list = parts.changes(view, draft, sync);
      const map = axesCount > 1 && !W.isExport ? W.workspaceMap(() => draft.state, data.scene.ramp, (pose) => sync(() => draft.change((state) => { state.pose = { ...state.pose, ...pose }; })), data.cuts.length > 0) : null;
      const undo = W.make("button", { type: "button", text: W.word("undo"), onclick: () => { if (draft.undo()) sync(); } });
      const [title, answer, doubts] = W.head(view, data.name), top = title;
      place.replaceChildren(title, answer, doubts, ...(draft.isOther ? [W.make("p", { class: "notes", text: W.word("draft.other") })] : []),
        W.make("div", { class: "wb-two" },
          W.make("div", {}, W.section(W.word("scene"), scene.node, jointColours(data, scene)),
            ...(chart ? [W.section(W.word("responses"), chart.node)] : []),
            ...(data.cuts.length ? [W.section(W.word("lobes"), W.make("p", { class: "key", text: W.word("quick.note") }), lobes.node)] : [])),
          W.make("section", {}, W.make("h2", { text: W.word("move") }), words, live, fault,
            ...(axesCount ? [W.make("h3", { text: W.word("axes") }), ...rows.slice(0, axesCount)] : []),
            W.make("h3", { text: W.word("springs") }), W.make("p", { class: "key", text: W.word("springs.key") }), ...rows.slice(axesCount))),
        ...(map ? [map] : []), W.section(W.word("differs"), W.make("div", { class: "wb-run" }, undo), list, parts.saver(draft, W.isExport)), same);
      this.undo = () => { if (draft.undo()) sync(); };
      send();
    },
  };
  window.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && W.current === "machine" && event.target.type !== "text") {
      event.preventDefault(); W.views.machine.undo();
    }
  });
})(window.Workbench);
