"use strict";
// Views of tests: modes, and blows that a person accepts or refuses; the full pages stand below in a frame.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const chosen = {}, keptPlace = W.keptPlace;
  // An existing page in a frame of its own: it runs its own scripts and reaches nothing else.
  W.pageFrame = function (name, title, onchoice) {
    if (W.isExport) return W.make("p", {}, W.make("a", { href: W.exportedPage(name), text: title }));
    const frame = W.make("iframe", { class: "wb-page", title, sandbox: "allow-scripts", loading: "lazy" });
    const show = W.make("button", { type: "button", text: W.word("show.page"), onclick: () => { frame.src = "/page/" + name.split("/").map(encodeURIComponent).join("/"); box.append(frame); show.remove(); note.remove(); } });
    const note = W.make("span", { class: "key", text: " " + W.word("page.takes") });
    const box = W.make("div", {}, W.make("p", {}, show, note));
    if (onchoice) window.addEventListener("message", (event) => { // of this frame alone; what it says is checked by the server
      const text = event.source === frame.contentWindow && event.data ? event.data.toolpointChoice : undefined;
      if (typeof text === "string") onchoice(text);
    });
    return box;
  };
  // Poles clicked in the page of the modes: kept as the choice of the test, and taken back.
  function choiceBar(data) {
    const words = W.make("span", { class: "key", "aria-live": "polite" });
    const said = keptPlace("chosen " + data.test, () => W.make("p", { role: "status", class: "key", id: "wb-chosen" }));
    let chosen = data.choice.trim();
    const write = (text) => async () => {
      said.className = "key";
      try {
        const answer = await W.ask("choice", { test: data.test, text });
        said.textContent = W.word(text ? "choice.kept" : "choice.gone", { place: answer.place, text: answer.command });
      } catch (error) { said.textContent = error.message; said.className = "wb-fault"; }
    };
    const keep = W.make("button", { type: "button", class: "wb-main", id: "wb-choice", text: W.word("choice.keep"), disabled: true, onclick: () => write(chosen)() });
    const back = W.make("button", { type: "button", text: W.word("take.back"), hidden: !data.choice, onclick: write("") });
    const bar = W.make("div", {}, W.make("div", { class: "wb-run" }, keep, back, words), said);
    bar.refresh = (current) => { data = current; back.hidden = !data.choice; bar.put(chosen); };
    bar.put = (text) => {
      chosen = text.trim();
      const count = chosen.split("\n").filter((line) => line.startsWith("  - ")).length;
      keep.disabled = !chosen || chosen === data.choice.trim();
      words.textContent = count ? W.word("choice.count", { n: count }) : W.word("choice.none");
    };
    bar.put(data.choice);
    return bar;
  }
  function chooser(view, key) {
    if (view.data.tests.length < 2) return null;
    const select = W.make("select", { id: "wb-test", onchange: () => { chosen[key] = select.value; W.open(true); } },
      view.data.tests.map((name) => W.make("option", { value: name, text: name, selected: name === view.data.test })));
    return W.make("div", { class: "wb-run" }, W.make("label", { for: "wb-test", text: W.word("test") }), select);
  }
  // The response that a decided blow contributes to, beside that of the last run.
  function followed(response) {
    const chart = new W.LineChart({ x: W.word("frequency") + ", Hz", y: W.word("rec.size"), logY: true, height: 240, label: W.word("follows.label", { output: response.output, input: response.input }) });
    const words = response.earlier ? W.word("follows.change", { output: response.output, input: response.input, n: W.number(100 * response.change, 2) })
      : W.word("follows.label", { output: response.output, input: response.input });
    chart.set({ lines: [...(response.earlier ? [{ x: response.frequency_hz, y: response.earlier, kind: "saved y", name: W.word("follows.before") }] : []),
      { x: response.frequency_hz, y: response.size, kind: "now", name: W.word("follows.now") }] });
    return W.section(W.word("follows"), W.make("p", { id: "wb-followed", text: `${words} ${W.spoken(response.status).text}` }), chart.node);
  }
  const query = (key) => () => chosen[key] ? "?test=" + encodeURIComponent(chosen[key]) : "";
  const titles = () => ({ modes: W.word("page.modes"), correlate: W.word("page.correlate"), blows: W.word("page.blows") });

  W.views.modes = {
    title: () => W.word("view.modes"), query: query("modes"),
    show(place, view) {
      const data = view.data, [title, answer, doubts] = W.head(view, W.word("view.modes")), test = data.test;
      // A doubtful mode says so beside its frequency: a column of its own would lie beyond the edge of a phone.
      const frequency = (mode) => { const text = W.withInterval(mode.frequency_hz, mode.frequency_interval_hz, "Hz");
        return mode.doubtful ? W.make("span", {}, text + " ", W.make("span", { class: "mark doubtful", text: W.word("doubtful") })) : text; };
      const rows = data.modes.map((mode, i) => [i + 1, frequency(mode), W.withInterval(100 * mode.damping_ratio, mode.damping_interval === null ? null : 100 * mode.damping_interval, "%")]);
      const pageOf = (name) => () => {
        const kind = name.split("/")[0], bar = kind === "modes" && !W.isExport ? choiceBar(data) : null;
        const section = W.section(titles()[kind], ...(bar ? [bar] : []), W.pageFrame(name, titles()[kind], bar && bar.put));
        section.refresh = (current) => { if (bar) bar.refresh(current); };
        return section;
      };
      // A page of the same modes, in which a person may have clicked poles, stays where it is when the view is drawn anew.
      const stamp = (name) => name.startsWith("modes/") ? JSON.stringify(data.modes) : W.draws;
      W.fillParts(place, [["title", "", () => title], ["answer", [view.answer, view.is_stale], () => answer], ["doubts", view.doubts, () => doubts],
        ...(data.tests.length < 2 ? [] : [["chooser", [data.tests, test], () => chooser(view, "modes")]]),
        ["table", data.modes, () => W.section(W.word("modes"), W.table([W.word("mode"), W.word("frequency"), W.word("damping")], rows))],
        ...data.pages.map((name) => [`page ${name} ${stamp(name)}`, "", pageOf(name), (node) => node.refresh(data)]), ["same", [view.commands, view.calls], () => W.same(view)]]);
    },
  };

  W.views.blows = {
    title: () => W.word("view.blows"), query: query("blows"),
    show(place, view) {
      const data = view.data, said = keptPlace("decided " + data.test, () => W.make("p", { role: "status", class: "key", id: "wb-decided" }));
      const heard = keptPlace("heard " + data.test, () => W.make("div")), follows = keptPlace("follows " + data.test, () => W.make("div", { id: "wb-follows" }));
      const decide = (hit, accept) => async () => {
        try {
          const answer = await W.ask("hit", { test: data.test, hit, accept });
          said.textContent = W.word("decided", { text: answer.command }); said.className = "key";
          follows.replaceChildren(...(answer.response ? [followed(answer.response)] : []));
        } catch (error) { said.textContent = error.message; said.className = "wb-fault"; }
      };
      const row = (hit) => [hit.name, hit.struck, W.number(hit.force_n, 4), W.make("span", {}, W.make("span", { class: "mark " + (hit.accepted ? "good" : "doubtful"),
        text: W.word(hit.accepted ? "accepted" : "refused") + (hit.by_hand ? ", " + W.word("by.hand") : "") })), W.make("span", W.spoken(hit.reasons.join("; "))),
      data.can_decide && !W.isExport ? W.make("span", { class: "wb-row" }, W.make("button", { type: "button", text: W.word("rec.hear"), "aria-label": `${W.word("rec.hear")} ${hit.name}`, onclick: () => W.hearBlow(heard, data.test, hit.name, false) }), W.make("button", { type: "button", text: W.word(hit.accepted ? "refuse" : "accept"), "aria-label": `${W.word(hit.accepted ? "refuse" : "accept")} ${hit.name}`, onclick: decide(hit.name, !hit.accepted) })) : ""];
      const head = [W.word("blow"), W.word("struck"), W.word("force"), W.word("verdict"), W.word("reasons"), ""];
      const odd = data.hits.filter((hit) => !hit.accepted || hit.by_hand || hit.reasons.length), good = data.hits.filter((hit) => !odd.includes(hit));
      place.replaceChildren(...W.head(view, W.word("view.blows")), ...[chooser(view, "blows")].filter(Boolean), said, follows, heard,
        W.section(W.word("blows.odd"), odd.length ? W.table(head, odd.map(row)) : W.make("p", { text: W.word("none") })),
        W.section(W.word("blows.good"), W.make("details", {}, W.make("summary", { text: W.word("blows.count", { n: good.length }) }), W.make("div", { class: "wb-inside" }, W.table(head, good.map(row))))),
        ...(data.notes.length ? [W.section(W.word("notes"), W.make("ul", {}, data.notes.map((text) => W.make("li", W.spoken(text)))))] : []),
        ...data.pages.map((name) => W.section(titles().blows, W.pageFrame(name, titles().blows))), W.same(view));
    },
  };
})(window.Workbench);
