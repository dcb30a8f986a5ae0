"use strict";
// Views of motion: circles of the servo, and NC programs with their path coloured; the full pages stand below in a frame.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const chosen = {};
  const viewOf = (key) => ({
    title: () => W.word("view." + key),
    query: () => chosen[key] ? "?part=" + encodeURIComponent(chosen[key]) : "",
    show(place, view) {
      const data = view.data;
      const rows = data.parts.map((part) => [W.make("button", { type: "button", "aria-pressed": String(part.name === data.part), class: part.name === data.part ? "wb-main" : null,
        text: part.name, onclick: () => { chosen[key] = part.name; W.open(true); } }), W.make("span", W.spoken(part.words)), W.word(part.is_of_today ? "state.fresh" : "state.stale")]);
      place.replaceChildren(...W.head(view, W.word("view." + key)),
        W.section(W.word(key + ".parts"), W.table([W.word("name"), W.word("what"), W.word("state")], rows)),
        ...data.pages.map((name) => W.section(W.word("page." + key), W.pageFrame(name, W.word("page." + key)))), W.same(view));
    },
  });
  W.views.servo = viewOf("servo");
  W.views.program = viewOf("program");
})(window.Workbench);
