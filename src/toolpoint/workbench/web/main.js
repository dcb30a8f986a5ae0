"use strict";
// The page: one view at a time by its address, the job of the project, and looks again where files have changed.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  W.job = null;
  W.current = "";

  W.jobWords = function (job) {
    if (!job || !job.state) return "";
    if (job.state === "running") return W.word(job.is_resumed ? "job.resumed" : "job.running", { step: job.current || "…", n: job.ended.length, total: job.total || "?" });
    return job.state === "ended" ? "" : W.word("job." + job.state) + (job.words ? ": " + W.spoken(job.words).text : "");
  };

  function showJob(job) {
    W.job = job;
    document.getElementById("wb-job").textContent = W.jobWords(job);
    const view = W.views[W.current];
    if (view && view.refresh) view.refresh(job);
  }

  let listed = "";
  async function listViews(asked) {
    const { views, name } = await (asked || W.ask("view/list"));
    W.known = views;
    document.getElementById("wb-name").textContent = name;
    document.title = `${name} · toolpoint`;
    const shown = views.filter((key) => W.views[key]).map((key) => key + W.views[key].title()).join();
    if (shown === listed) return; // the link under the mouse stays
    listed = shown;
    document.getElementById("wb-nav").replaceChildren(...views.filter((key) => W.views[key]).map((key) =>
      W.make("a", { href: "#/" + key, "data-view": key, text: W.views[key].title(), ...(key === W.current ? { "aria-current": "" } : {}) })));
  }

  let turn = 0, shownText = "";
  const viewOfAddress = () => (/^#\/([\w-]+)/.exec(location.hash) || [])[1] || "project";
  // isByServer: a change that no person asked for; it waits until nobody types or presses.
  async function open(isAgain, asked, isByServer) {
    const name = viewOfAddress(), mine = ++turn, place = document.getElementById("view");
    const known = W.views[name] ? name : "project";
    if (!isAgain || known !== W.current) place.replaceChildren(W.make("p", { class: "key", role: "status", text: W.word("loading") }));
    W.current = known;
    for (const link of document.querySelectorAll("#wb-nav a")) link.toggleAttribute("aria-current", link.dataset.view === known);
    // On a phone the names of the views are a row that scrolls: that of the view must not lie beyond the edge.
    const nav = document.getElementById("wb-nav"), current = nav.querySelector("[aria-current]");
    if (current) nav.scrollLeft = current.offsetLeft - nav.offsetLeft - (nav.clientWidth - current.offsetWidth) / 2;
    try {
      const view = await (asked && asked.name === known ? asked.answer : W.ask("view/" + known + (W.views[known].query ? W.views[known].query() : "")));
      if (mine !== turn) return;
      const text = known + JSON.stringify(view, (key, value) => key === "age_s" ? undefined : value);
      if (isAgain && text === shownText) return; // nothing has changed: what a person is doing is not drawn over
      if (isByServer && W.isHeld()) { W.whenFree(() => open(true, undefined, true)); return; }
      const putBack = isAgain && shownText.startsWith(known) ? W.keepPlace(place) : null;
      shownText = text;
      W.views[known].show(place, view);
      W.shown = view;
      W.draws = (W.draws || 0) + 1;
      if (putBack) putBack();
      if (!isAgain) place.focus({ preventScroll: true });
    } catch (error) { if (mine !== turn) return; place.replaceChildren(W.fault(error)); }
    document.body.dataset.ready = known;
  }
  W.open = open;

  let waiting = 0;
  function again() { // many files change at once while a job runs: one look for all of them
    clearTimeout(waiting);
    waiting = setTimeout(async () => { await listViews(); open(true, undefined, true); }, 300);
  }

  async function all() {
    showJob(await W.ask("job"));
    again();
  }

  async function start() {
    await W.begin();
    // All that the first view needs is asked for at once.
    const name = W.views[viewOfAddress()] ? viewOfAddress() : "project", first = W.ask("view/" + name), list = W.ask("view/list");
    first.catch(() => {}); list.catch(() => {});
    await W.loadWords();
    try { await listViews(list); } catch (error) { document.getElementById("view").replaceChildren(W.fault(error)); return; }
    if (!W.isExport) W.ask("job").then(showJob, () => {});
    window.addEventListener("hashchange", () => open(false));
    await open(false, { name, answer: first }); // the address may have changed since
    W.on("reset", all);
    W.on("changed", again);
    W.on("job", (job) => { showJob(job); if (job.state !== "running") again(); });
    W.on("step", (event) => {
      if (!W.job) return;
      if (event.total) W.job.total = event.total;
      if (event.ended) { if (!W.job.ended.includes(event.step)) W.job.ended.push(event.step); W.job.current = ""; }
      else if (event.step) W.job.current = event.step;
      showJob(W.job);
    });
    W.listen();
    document.getElementById("wb-foot").textContent = [W.word(W.isExport ? "foot.export" : "foot"), ...(W.language() === "en" ? [] : [W.word("foot.english")])].join(" ");
  }
  window.addEventListener("DOMContentLoaded", start);
})(window.Workbench);
