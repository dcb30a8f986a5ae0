"use strict";
// Views of what to change and measure, of two machine files side by side, and of the pages that a project has.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const MIN_NARROWING = 0.02; // of an interval: a test that brings less is not advised (next_test.py)
  const LEAST = 5e-6; // of a share: a smaller difference is none
  const percent = (share, digits = 2) => Math.abs(share) < LEAST ? "0 %" : `${share > 0 ? "+" : ""}${W.number(100 * share, digits)} %`;

  // Limits, modes, responses and springs of two machines side by side.
  function differenceOf(data) {
    const rows = data.frequency_hz[0].map((f, i) => {
      const g = data.frequency_hz[1][i];
      return [i + 1, W.hertz(f), g === undefined ? "–" : W.hertz(g), g === undefined ? "" : percent(g / f - 1, 3)];
    });
    const mm = (v) => v === null ? W.word("none") : `${W.number(1e3 * v, 3)} mm`, content = [];
    content.push(W.section(W.word("limits"), W.table([W.word("goal"), W.word("speed"), W.word("first"), W.word("second")], data.limits.map((limit) => [limit.goal, Math.round(limit.speed_rpm), mm(limit.first_m), mm(limit.second_m)]))),
      W.section(W.word("modes"), W.table([W.word("mode"), W.word("first"), W.word("second"), W.word("change")], rows)));
    if (data.responses[0] && data.responses[1]) {
      const chart = new W.LineChart({ x: "Hz", y: "µm/N", logX: true, logY: true, height: 300, label: W.word("responses") });
      content.push(W.section(W.word("responses"), chart.node));
      const micro = (text) => W.floats(text).map((v) => 1e6 * v);
      chart.set({ lines: [0, 1].flatMap((k) => ["x", "y", "z"].map((way) => ({ x: data.lines_hz, y: micro(data.responses[k][way]), kind: `${k ? "" : "saved"} ${way}`, name: k || way === "x" ? `${way}${k ? "" : ", " + W.word("first")}` : "" }))) });
    }
    content.push(W.section(W.word("springs"), data.springs.length ? W.table([W.word("what"), W.word("first"), W.word("second"), W.word("change")],
      data.springs.map((spring) => [spring.path.replace("joints.", "").replace(".stiffness", ""), ...[spring.first, spring.second].map((value) => value === null ? "–" : W.machineParts.withUnit(value, spring.path.split(".").at(-1))), spring.first && spring.second ? percent(spring.second / spring.first - 1, 3) : ""])) : W.make("p", { text: W.word("none") })));
    return content;
  }

  // Half widths of an answer as bars: today, after a test, after a random one.
  function widthBars(entries) {
    const largest = Math.max(...entries.map(([, value]) => value));
    return W.make("ul", { class: "wb-bars" }, entries.map(([words, value]) => {
      const bar = W.make("span", { class: "wb-width", "aria-hidden": "true" });
      bar.style.width = `${60 * value / largest}%`;
      return W.make("li", {}, W.make("span", { text: `${words}: ± ${W.number(100 * value, 2)} %` }), bar);
    }));
  }

  W.views.advice = {
    title: () => W.word("view.advice"),
    show(place, view) {
      const data = view.data;
      const attempt = (change) => () => { // the springs of the joint are set on the machine's page, where everything follows
        const draft = new W.Draft(data.machine, data.digest);
        draft.change((state) => { state.values = { ...state.values, ...change.values }; });
        location.hash = "#/machine";
      };
      const shown = W.keptPlace("difference " + data.digest, () => W.make("div", { id: "wb-difference", "aria-live": "polite" }));
      const compare = (change) => async () => {
        shown.replaceChildren(W.make("p", { class: "key", role: "status", text: W.word("loading") }));
        try {
          const answer = await W.ask("machine/difference", { values: change.values }), same = W.make("details", { class: "wb-same" }, W.make("summary", { text: W.word("same") }));
          W.fillSame(same, answer.commands, answer.calls);
          shown.replaceChildren(W.make("h2", { text: W.word("difference.of", { name: change.name }) }), W.doubts(answer.doubts), ...differenceOf(answer), same);
        } catch (error) { shown.replaceChildren(W.fault(error)); }
      };
      const changes = data.changes.map((change, i) => [i + 1, change.name, change.joint, percent(change.stiffness_share, 3), percent(change.gain),
        `${percent(change.gain_interval[0])} … ${percent(change.gain_interval[1])}`, W.number(change.cost, 3),
        W.make("span", { class: "wb-row" }, ...(W.isExport ? [] : [W.make("button", { type: "button", text: W.word("show.difference"), "aria-label": `${W.word("show.difference")}: ${change.name}`, onclick: compare(change) })]),
          W.make("button", { type: "button", text: W.word("try"), "aria-label": `${W.word("try")}: ${change.name}`, onclick: attempt(change) }))]);
      const narrowed = W.keptPlace("narrowed " + JSON.stringify(data.next), () => W.make("div", { id: "wb-narrowed", "aria-live": "polite" }));
      const narrow = (entry) => () => narrowed.replaceChildren(W.make("h3", W.spoken(entry.test)), widthBars([[W.word("width.today"), next.today], [W.word("width.random"), next.random], [W.word("width.after"), entry.after]]),
        W.make("p", { class: "key", text: W.word("width.key", { answer: W.spoken(next.answer).text, n: Math.round(100 * (1 - entry.after / next.today)) }) }));
      const next = data.next, isFlat = (next.candidates || []).length > 0 && next.candidates[0].after > (1 - MIN_NARROWING) * next.today;
      const tests = (isFlat ? [] : next.candidates || []).map((entry, i) => [i + 1, W.make("span", W.spoken(entry.test)), `± ${W.number(100 * entry.after, 2)} %`,
        W.make("button", { type: "button", text: W.word("show.difference"), "aria-label": `${W.word("show.difference")}: ${entry.test}`, onclick: narrow(entry) })]);
      place.replaceChildren(...W.head(view, W.word("view.advice")),
        W.section(W.word("what.change"), changes.length ? W.table(["", W.word("change"), W.word("joint"), W.word("springs.by"), W.word("gain"), W.word("interval.95"), W.word("cost"), ""], changes, W.word("gain.key")) : W.make("p", { text: W.word("none") })), shown,
        ...(tests.length ? [W.section(W.word("what.measure"), W.table(["", W.word("test"), W.word("after.it"), ""], tests,
          W.word("next.key", { answer: W.spoken(next.answer).text, today: W.number(100 * next.today, 2), random: W.number(100 * next.random, 2) })), narrowed)] : []),
        ...(isFlat ? [W.section(W.word("what.measure"), W.make("p", { text: W.word("next.flat", { answer: W.spoken(next.answer).text, today: W.number(100 * next.today, 2) }) }))] : []), W.same(view));
    },
  };

  const pair = {};
  W.views.compare = {
    title: () => W.word("view.compare"),
    query: () => pair.first ? `?first=${encodeURIComponent(pair.first)}&second=${encodeURIComponent(pair.second)}` : "",
    show(place, view) {
      const data = view.data, select = (key) => {
        const list = W.make("select", { id: "cmp-" + key, onchange: () => { pair.first = pair.first || data.first; pair.second = pair.second || data.second; pair[key] = list.value; W.open(true); } },
          data.files.map((file) => W.make("option", { value: file, ...W.spoken((data.labels || {})[file] || file), selected: file === data[key] })));
        return W.make("label", { for: "cmp-" + key }, W.word(key) + " ", list);
      };
      const content = [];
      if (data.test_rows) content.push(W.section(W.word("modes"), W.table([["mode"], ["first", ", Hz"], ["second", ", Hz"], ["change", ", %"], ["interval.95", ", %"], ["mac"], ["mac.noise"], ["verdict"]].map(([key, unit]) => W.word(key) + (unit || "")), data.test_rows),
        W.make("ul", {}, data.test_lines.map((text) => W.make("li", W.spoken(text))))));
      if (data.state_tables) content.push(...data.state_tables.map((part) => W.section(W.spoken(part.title).text, W.table(part.header.map((text) => W.spoken(text).text), part.rows))),
        W.section(W.word("what.changed"), W.make("ul", {}, data.state_changes.length ? data.state_changes.map((text) => W.make("li", W.spoken(text))) : W.make("li", { text: W.word("none") }))));
      if (data.springs) content.push(...differenceOf(data));
      place.replaceChildren(...W.head(view, W.word("view.compare")), W.make("div", { class: "wb-run" }, select("first"), select("second")), ...content, W.same(view));
    },
  };

  let shown = "";
  W.views.report = {
    title: () => W.word("view.report"),
    query: () => shown ? "?page=" + encodeURIComponent(shown) : "",
    show(place, view) {
      const data = view.data, current = (data.pages || []).find((page) => page.name === data.page);
      const list = W.make("div", { class: "wb-run", role: "group", "aria-label": W.word("pages") }, (data.pages || []).map((page) =>
        W.make("button", { type: "button", "aria-pressed": String(page.name === data.page), class: page.name === data.page ? "wb-main" : null, ...W.spoken(page.title), onclick: () => { shown = page.name; W.open(true); } })));
      place.replaceChildren(...W.head(view, W.word("view.report")), list, ...(current ? [W.section(W.spoken(current.title).text, W.pageFrame(current.name, W.spoken(current.title).text))] : []), W.same(view));
    },
  };
})(window.Workbench);
