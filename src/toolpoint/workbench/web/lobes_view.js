"use strict";
// View of lobes: the limit at my speed follows the sliders; its interval and the exact curve come when they rest.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const REST = 600; // ms without a move before the slow answers are asked for

  function cutSlider(slider, state, send) {
    const names = { tangential: "K_t", normal: "K_n", immersion: W.word("immersion"), diameter: W.word("diameter"), teeth: W.word("teeth") };
    const show = (v) => `${W.number(v / slider.scale, 4)} ${slider.unit}`.trim();
    return W.plainSlider({ id: "cut-" + slider.key, label: names[slider.key] || slider.key, low: slider.lower, high: slider.upper, step: slider.step,
      value: state.cut_values[slider.key] ?? slider.value, show, unit: slider.unit, scale: slider.scale, onmove: (v) => { state.cut_values[slider.key] = v; send(); } });
  }

  // Another stick-out is another tip: the coupled tool takes the place of the machine or the struck tip until it is put back.
  function stickOut(entry, state, send) {
    if (entry.reason || W.isExport) return entry.reason ? [W.make("p", { class: "key", id: "stick-out-reason", ...W.spoken(entry.reason) })] : [];
    const label = W.word("stick.out", { segment: entry.segment });
    const slider = W.plainSlider({ id: "stick-out", label, low: entry.lower, high: entry.upper, value: state.stick_out ?? entry.value,
      show: (v) => `${W.number(1e3 * v, 4)} mm`, unit: "mm", scale: 1e-3, onmove: (v) => { state.stick_out = v; back.disabled = false; send(); } });
    const back = W.make("button", { type: "button", id: "stick-out-back", disabled: state.stick_out === undefined, text: W.word("stick.out.back"),
      onclick: () => { delete state.stick_out; slider.put(entry.value); back.disabled = true; send(); } });
    return [slider, W.make("p", { class: "wb-run" }, back, W.make("span", { class: "key", text: W.word("stick.out.key") }))];
  }

  // A number that is followed by nothing, or by one of the units. "0,5" is no number here: parseFloat would take it as 0, and 2 cm as 2.
  W.readNumber = function (text, units) {
    const match = /^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(.*?)\s*$/i.exec(text);
    return match && ["", ...units].includes(match[2]) ? Number(match[1]) : Number.NaN;
  };

  // A slider with a field for a number; the unit beside it is fixed.
  W.plainSlider = function ({ id, label, low, high, step, value, show, unit, scale, onmove }) {
    const units = unit === W.word("speed") ? [unit, "rpm", "rev/min", "1/min"] : [unit], said = W.make("p", { class: "wb-fault", role: "alert", hidden: true });
    const slider = W.make("input", { type: "range", id, min: low, max: high, step: step || (high - low) / 500, value, "aria-label": label });
    const field = W.make("input", { type: "text", class: "wb-value", value: show(value), "aria-label": `${label}, ${W.word("with.unit")}` });
    const write = (v) => { field.value = show(v); W.sayValue(slider, field.value); };
    write(value);
    slider.addEventListener("input", () => { write(Number(slider.value)); onmove(Number(slider.value)); });
    field.addEventListener("change", () => {
      const v = scale * W.readNumber(field.value, units);
      said.hidden = Number.isFinite(v);
      if (!Number.isFinite(v)) {
        said.textContent = W.word(unit ? "number.refused" : "number.refused.plain", { text: field.value, unit });
        write(Number(slider.value));
        return;
      }
      const taken = step ? Math.min(Math.max(Math.round(v / step) * step, low), high) : v; // whole numbers alone
      slider.value = taken; write(taken); onmove(taken);
    });
    const row = W.make("div", { class: "wb-slider" }, W.make("label", { for: id, text: label }), slider, field, said);
    row.put = (v) => { slider.value = v; write(v); said.hidden = true; };
    return row;
  };

  function intervalWords(answer, state) {
    const depth = (v) => v === null ? `> ${W.number(1e3 * answer.searched_m, 3)}` : W.number(1e3 * v, 3);
    const words = [W.word("interval.is", { speed: Math.round(answer.speed_rpm), limit: depth(answer.limit_m), low: depth(answer.lower_m), high: depth(answer.upper_m) })];
    if (answer.stable_probability !== null) words.push(W.word("chance.is", { depth: W.number(1e3 * answer.depth_m, 3), p: Math.round(100 * answer.stable_probability) }));
    const first = Object.entries(answer.shares)[0];
    if (first) words.push(W.word("mostly", { what: W.spoken(first[0]).text, p: Math.round(100 * first[1]) }));
    words.push(W.word(answer.is_weighed ? "draws.weighed" : "draws", { n: answer.draws }));
    return words.join(" ");
  }

  function goalRows(view) {
    const rows = Object.entries(view.data.goals).map(([name, goal]) => {
      const kept = goal.kept, mm = (v) => v === null || v === undefined ? "–" : W.number(1e3 * v, 3);
      const end = (kept, v) => v === null ? `> ${mm(kept.depth_max_m)}` : mm(v); // no limit down to the depth that was searched
      return [name, goal.cut, Math.round(goal.speed_rpm), mm(goal.depth_m), kept ? end(kept, kept.limit_m) : "–",
        kept ? kept.interval_m[0] === null ? end(kept, null) : `${mm(kept.interval_m[0])} – ${end(kept, kept.interval_m[1])}` : "–",
        kept ? `${Math.round(100 * kept.stable_probability)} %` : "–", W.word(goal.is_old ? "state.stale" : "state.fresh")];
    });
    return rows.length ? W.section(W.word("limits"), W.table([W.word("goal"), W.word("cut"), W.word("speed"), W.word("depth"), W.word("limit"), W.word("interval"), W.word("stable"), W.word("state")], rows)) : null;
  }

  let stood = {}; // where the sliders of each cut stand: a redraw of the view takes them over
  W.views.lobes = {
    title: () => W.word("view.lobes"),
    show(place, view) {
      const data = view.data, same = W.same(view), fault = W.make("div"), live = W.make("div");
      if (!place.querySelector("#lobes-cut")) stood = {};
      if (!data.cuts.length) { place.replaceChildren(...W.head(view, W.word("view.lobes")), same); return; }
      const words = W.make("p", { class: "wb-limit", "aria-live": "polite" }), sure = W.make("p", { "aria-live": "polite", id: "wb-interval" });
      const sliders = W.make("div"), marks = { goals: [], tried: [], mine: [] }, kept = JSON.parse(localStorage.getItem("toolpoint-lobes-" + document.title) || "{}");
      let cut = data.cuts.find((entry) => entry.name === kept.cut) || data.cuts[0], state, lines = {}, turn = 0, timer = 0, speed, depth;
      const chart = new W.LineChart({ x: W.word("speed"), y: W.word("depth"), height: 380, label: W.word("lobes"), onpick: (x, y) => {
        const [low, high] = cut.speeds;
        state.speed = Math.min(Math.max(Math.round(x), low), high); state.cut_values.depth = Math.max(y, 0.01) / 1e3;
        speed.put(state.speed); depth.put(state.cut_values.depth); send();
      } });
      let bars = [], limitDoubts = [], laterDoubts = [];
      const doubted = (more) => { // those of the limit, then those of the slower answers to the same state of the sliders
        laterDoubts = [...laterDoubts, ...more];
        live.replaceChildren(W.doubts(W.newDoubts(view, [...new Set([...limitDoubts, ...laterDoubts])])));
      };
      const draw = () => chart.set({ lines: Object.values(lines), marks: [...bars, ...marks.goals, ...marks.tried, ...marks.mine] });
      const rest = async () => {
        const mine = ++turn;
        sure.textContent = W.word("asking");
        try {
          const interval = await W.ask("machine/interval", state);
          if (mine !== turn || place.firstChild !== title) return;
          sure.textContent = intervalWords(interval, state);
          doubted(interval.doubts);
          marks.mine = [{ x: interval.speed_rpm, y: 1e3 * (interval.limit_m ?? interval.searched_m), low: 1e3 * (interval.lower_m ?? interval.searched_m),
            high: interval.upper_m === null ? Infinity : 1e3 * interval.upper_m, kind: interval.limit_m === null ? "above" : "exact", name: W.word(interval.limit_m === null ? "no.limit" : "interval.mark") }];
          draw();
          const curve = await W.ask("machine/curve", { ...state, count: 100 });
          if (mine !== turn || place.firstChild !== title) return;
          lines.exact = { x: W.floats(curve.speeds), y: W.floats(curve.limit).map((v) => 1e3 * v), kind: "exact", name: W.word("exact") };
          doubted(curve.doubts);
          draw();
        } catch (error) { if (mine === turn) sure.textContent = error.message; }
      };
      const show = (answer) => {
        if (place.firstChild !== title) return;
        const limit = answer.limit, quick = limit.quick;
        delete lines.exact; bars = []; // of another state of the sliders
        if (quick) lines.quick = { x: W.floats(quick.speeds), y: W.floats(quick.limit).map((v) => 1e3 * v), kind: "quick", name: W.word("quick") };
        marks.mine = [{ x: limit.speed_rpm, y: 1e3 * (limit.limit_m ?? limit.searched_m), kind: limit.limit_m === null ? "above" : "exact", name: W.word(limit.limit_m === null ? "no.limit" : "exact.here") },
          ...(state.cut_values.depth ? [{ x: limit.speed_rpm, y: 1e3 * state.cut_values.depth, kind: "goal", name: W.word("asked") }] : [])];
        words.textContent = W.word("deep", { speed: Math.round(limit.speed_rpm), depth: limit.limit_m === null ? `> ${W.number(1e3 * limit.searched_m, 3)} mm` : `${W.number(1e3 * limit.limit_m, 3)} mm` })
          + (limit.chatter_hz ? W.word("chatter.at", { f: W.number(limit.chatter_hz, 4) }) : "");
        limitDoubts = answer.doubts; laterDoubts = [];
        doubted([]);
        W.fillSame(same, answer.commands, answer.calls);
        fault.replaceChildren();
        W.moves = (W.moves || 0) + 1;
        draw();
      };
      const ask = W.latest((body) => W.ask("machine/limit", body), show, (error) => fault.replaceChildren(W.fault(error)));
      const send = () => {
        turn++; clearTimeout(timer); sure.textContent = W.word("interval.rest");
        if (!W.isExport) timer = setTimeout(rest, REST);
        localStorage.setItem("toolpoint-lobes-" + document.title, JSON.stringify({ cut: cut.name, speed: state.speed }));
        ask({ ...state, cut_values: { ...state.cut_values } });
      };
      const choose = () => {
        const stamp = JSON.stringify([cut, data.stick_out]), old = stood[cut.name];
        state = old && old.stamp === stamp ? old.state : { cut: cut.name, speed: kept.cut === cut.name && kept.speed ? kept.speed : cut.speed_rpm, cut_values: cut.depth_m ? { depth: cut.depth_m } : {}, values: {}, pose: {} };
        stood[cut.name] = { stamp, state };
        speed = W.plainSlider({ id: "lobes-speed", label: W.word("spindle"), low: cut.speeds[0], high: cut.speeds[1], value: state.speed,
          show: (v) => `${Math.round(v)} ${W.word("speed")}`, unit: W.word("speed"), scale: 1, onmove: (v) => { state.speed = v; send(); } });
        depth = W.plainSlider({ id: "lobes-depth", label: W.word("my.depth"), low: 1e-4, high: Math.max(0.02, 3 * (cut.depth_m || 0.005)), value: state.cut_values.depth || cut.depth_m || 0.003,
          show: (v) => `${W.number(1e3 * v, 3)} mm`, unit: "mm", scale: 1e-3, onmove: (v) => { state.cut_values.depth = v; send(); } });
        sliders.replaceChildren(speed, depth, ...cut.sliders.map((slider) => cutSlider(slider, state, send)), ...stickOut(data.stick_out, state, send));
        const goals = Object.entries(data.goals).filter(([, goal]) => goal.cut === cut.name);
        marks.goals = goals.filter(([, goal]) => goal.kept && !goal.is_old && !Object.keys(goal.pose).length).map(([name, goal]) => ({ x: goal.speed_rpm, y: 1e3 * goal.depth_m, kind: "goal", name: `${W.word("goal")} ${name}` }));
        marks.tried = data.tried.filter((tried) => !tried.cut || tried.cut === cut.name).map((tried) => ({ x: tried.speed_rpm, y: 1e3 * tried.depth_m, kind: tried.stable ? "stable" : "chatter", name: W.word(tried.stable ? "tried.stable" : "tried.chatter") }));
        lines = {};
        send();
      };
      const select = W.make("select", { id: "lobes-cut", onchange: () => { cut = data.cuts.find((entry) => entry.name === select.value); choose(); } },
        data.cuts.map((entry) => W.make("option", { value: entry.name, text: entry.name, selected: entry === cut })));
      const said = W.make("span", { class: "key", role: "status" });
      const band = W.make("button", { type: "button", id: "lobes-band", text: W.word("band"), onclick: W.onceAtATime(async () => {
        const mine = turn;
        said.textContent = W.word("band.takes");
        try {
          const answer = await W.ask("machine/band", state);
          if (mine === turn && place.firstChild === title) { // the sliders stand as they did
            const millimetres = (text) => W.floats(text).map((v) => 1e3 * v);
            // Bars, not a band: between the speeds the lobes go up and down, and a straight line there would be a claim.
            const low = millimetres(answer.lower), high = millimetres(answer.upper);
            bars = [...W.floats(answer.speeds)].map((x, i) => ({ x, y: low[i], low: low[i], high: high[i], kind: "interval", name: i ? "" : W.word("band.is", { n: answer.draws }) }));
            doubted(answer.doubts);
            draw();
          }
          said.textContent = "";
        } catch (error) { said.textContent = error.message; }
      }) });
      const heard = W.make("div"), hear = W.make("button", { type: "button", id: "lobes-hear", text: W.word("hear"), onclick: W.onceAtATime(async () => {
        heard.replaceChildren(W.make("p", { class: "key", role: "status", text: W.word("hear.takes") }));
        try {
          const answer = await W.ask("machine/sound", { ...state, cut_values: { depth: Number(depth.querySelector("input[type=range]").value), ...state.cut_values } });
          const play = () => W.playSound(W.floats(answer.sound), answer.rate);
          heard.replaceChildren(W.make("p", { id: "wb-heard", text: W.word("heard." + (answer.state === "withheld" ? "undecided" : answer.state), { speed: Math.round(answer.speed_rpm), depth: W.number(1e3 * answer.depth_m, 3),
            um: W.number(1e6 * answer.peak_to_peak_m, 2) }) + (answer.frequency_hz ? W.word("chatter.at", { f: W.number(answer.frequency_hz, 4) }) : "") }), W.doubts(W.newDoubts(view, answer.doubts)),
            W.make("p", {}, W.make("button", { type: "button", text: W.word("play"), onclick: play }), W.make("span", { class: "key", text: " " + W.word("hear.key") })),
            ...answer.commands.map((text) => W.make("div", { class: "wb-code" }, W.make("pre", { tabindex: "0", text }), W.copy(text))));
          W.heard = answer; play();
        } catch (error) { heard.replaceChildren(W.fault(error)); }
      }) });
      const [title, answer, doubts] = W.head(view, W.word("view.lobes"));
      place.replaceChildren(title, answer, doubts, W.make("div", { class: "wb-two" },
        W.section(W.word("lobes"), words, sure, chart.node,
          ...(W.isExport ? [] : [W.make("div", { class: "wb-run" }, band, hear, said), heard]), W.make("p", { class: "key", text: W.word("lobes.key") })),
        W.section(W.word("cut"), W.make("div", { class: "wb-run" }, W.make("label", { for: "lobes-cut", text: W.word("cut") }), select), sliders, live, fault)),
      ...[goalRows(view)].filter(Boolean), same);
      choose();
    },
  };
})(window.Workbench);
