"use strict";
// Map of the workspace: cells over two axes, coloured by first frequency, softest stiffness or limit of the cut; a click or Enter takes the pose.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const SMALL = 0.2; // of the value in the middle: a map of smaller differences does not use all colours
  const position = (axis, v) => axis.turns ? `${W.number(v * 180 / Math.PI, 4)}°` : `${W.number(1e3 * v, 4)} mm`;

  function cells(answer, key, ramp, act) {
    const [across, along] = answer.axes, values = W.floats(answer[key]), known = values.filter(Number.isFinite);
    const low = Math.min(...known), high = Math.max(...known), middle = (low + high) / 2, half = Math.max((high - low) / 2, SMALL * Math.abs(middle) / 2) || 1;
    const show = (v) => key === "stiffness" ? W.number(v / 1e6, 3) : key === "limit_m" ? W.number(1e3 * v, 3) : W.number(v, 4);
    const rows = [...along.positions.keys()].reverse().map((j) => W.make("tr", {}, W.make("th", { scope: "row", text: position(along, along.positions[j]) }),
      [...across.positions.keys()].map((i) => {
        const v = values[j * across.positions.length + i];
        if (!Number.isFinite(v)) return W.make("td", { text: "×", title: W.word("map.failed") });
        const share = (v - middle + half) / (2 * half), colour = ramp[Math.round((ramp.length - 1) * Math.min(Math.max(share, 0), 1))];
        const light = 0.3 * colour[0] + 0.6 * colour[1] + 0.1 * colour[2] > 0.55;
        const button = W.make("button", { type: "button", text: show(v), "data-place": `${i} ${j}`,
          "aria-label": `${across.name} ${position(across, across.positions[i])}, ${along.name} ${position(along, along.positions[j])}: ${show(v)}`,
          onclick: () => act({ [across.name]: across.positions[i], [along.name]: along.positions[j] }) });
        button.style.background = `rgb(${colour.map((c) => Math.round(255 * c)).join(" ")})`;
        button.style.color = light ? "#111" : "#fff";
        return W.make("td", {}, button);
      })));
    return W.make("div", { class: "table wb-map", tabindex: "0", role: "region", "aria-label": W.word("map") }, W.make("table", {},
      W.make("caption", { text: W.word({ stiffness: "map.stiffness", limit_m: "map.limit" }[key] || "map.frequency", { speed: Math.round(answer.speed_rpm), x: across.name, y: along.name, change: W.number(100 * (high - low) / Math.abs(middle), 2) }) }),
      W.make("tbody", {}, rows), W.make("tfoot", {}, W.make("tr", {}, W.make("td"), across.positions.map((v) => W.make("th", { scope: "col", text: position(across, v) }))))));
  }

  // state(): numbers and pose of the page; act(pose): where a person clicked; the map says when the page has gone on.
  W.workspaceMap = function (state, ramp, act, hasCut) {
    const said = W.make("span", { class: "key", role: "status" }), place = W.make("div");
    const drawn = {}, answers = {}; // by the question that gave them
    let question = "map", answer = null;
    const stamp = () => JSON.stringify([state().values, ...(question === "limit_map" ? [state().speed, state().cut] : []), Object.entries(state().pose).filter(([name]) => !answer || !answer.axes.some((axis) => axis.name === name))]);
    const choice = W.make("select", { id: "wb-map-of", "aria-label": W.word("map") }, [["stiffness", "stiffness"], ["frequency_hz", "frequency"], ...(hasCut ? [["limit_m", "limit"]] : [])].map(([value, key]) => W.make("option", { value, text: W.word("map.of." + key) })));
    const draw = () => {
      question = choice.value === "limit_m" ? "limit_map" : "map"; answer = answers[question] || null;
      if (!answer) { place.replaceChildren(); said.textContent = ""; return; }
      const same = W.make("details", { class: "wb-same" }, W.make("summary", { text: W.word("same") }));
      W.fillSame(same, answer.commands, answer.calls);
      place.replaceChildren(W.doubts(answer.doubts), cells(answer, answer[choice.value] ? choice.value : "frequency_hz", ramp, act), same);
      node.refresh();
    };
    choice.addEventListener("change", draw);
    const button = W.make("button", { type: "button", id: "wb-map", text: W.word("map.draw"), onclick: W.onceAtATime(async () => {
      draw();
      const asked = question, stand = stamp();
      said.textContent = W.word(asked === "limit_map" ? "asking.limits" : "asking.map");
      try { answers[asked] = await W.ask("machine/" + asked, state()); drawn[asked] = stand; said.textContent = ""; draw(); W.mapped = (W.mapped || 0) + 1; }
      catch (error) { said.textContent = error.message; }
    }) });
    const node = W.section(W.word("map"), W.make("div", { class: "wb-run" }, button, choice, said), place);
    node.refresh = () => { if (answer) said.textContent = stamp() === drawn[question] ? "" : W.word("map.old"); };
    return node;
  };
})(window.Workbench);
