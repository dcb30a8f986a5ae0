"use strict";
// View of the project: the chain as a picture, a step's words and doubts, what to do next, what one part more would give.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  let chosen = ""; // the step whose words are shown: a redraw does not go back to another
  function stepBox(view) {
    const box = W.make("div", { class: "wb-step-box", id: "wb-step", "aria-live": "polite" });
    const show = (step) => {
      const lines = [W.make("h3", { text: `${step.name}: `}, W.make("span", W.spoken(step.does))),
        W.make("p", {}, W.make("span", { class: "mark " + W.markOf(step.state), text: W.word("state." + step.state.replace(" ", "-")) }), " ", W.make("span", W.spoken(step.reason))),
        step.words ? W.make("p", { ...W.spoken(step.words), class: step.is_of_today ? null : "wb-old" }) : null];
      if (step.started) lines.push(W.make("p", { class: "key", text: W.word("ran", { when: step.started.replace("T", " "), s: W.number(step.seconds, 2) }) }));
      if (step.doubts.length) lines.push(W.make("div", { class: "notes warning" }, W.make("h3", { text: W.word("doubts") }),
        W.make("ul", {}, step.doubts.map((text) => W.make("li", W.spoken(text))))));
      if (step.files.length) lines.push(W.make("p", { class: "key", text: W.word("files") + " " + step.files.join(", ") }));
      lines.push(W.make("div", { class: "wb-code" }, W.make("pre", { text: step.command, tabindex: "0" }), W.copy(step.command)));
      box.replaceChildren(...lines.filter(Boolean));
    };
    const first = view.data.steps.find((step) => step.name === chosen) || view.data.steps.find((step) => step.state === "failed") || view.data.steps.find((step) => step.doubts.length) || view.data.steps.at(-1);
    if (first) show(first);
    return [box, (step) => { chosen = step.name; show(step); }];
  }

  W.markOf = (state) => ({ fresh: "good", "by hand": "assumed", failed: "doubtful", stopped: "doubtful", stale: "doubtful", "never run": "" })[state] || "";

  function limits(goals) {
    const names = Object.keys(goals);
    if (!names.length) return null;
    const millimetres = (value) => W.number(1e3 * value, 3);
    const rows = names.map((name) => {
      const goal = goals[name], [low, high] = goal.interval_m, above = `> ${millimetres(goal.depth_max_m)}`;
      return [name, Math.round(goal.speed_rpm), millimetres(goal.depth_m), goal.limit_m === null ? above : millimetres(goal.limit_m),
        low === null ? above : `${millimetres(low)} – ${high === null ? above : millimetres(high)}`, `${Math.round(100 * goal.stable_probability)} %`];
    });
    return W.section(W.word("limits"), W.table([W.word("goal"), W.word("speed"), W.word("depth"), W.word("limit"), W.word("interval"), W.word("stable")], rows));
  }

  function runBar() { // stays where it is: the button under the mouse is not another after a redraw
    let view = null;
    const text = W.make("span", { class: "key" }), fault = W.make("div");
    const run = W.make("button", { type: "button", class: "wb-main", text: W.word("run"), onclick: async () => {
      run.disabled = true;
      fault.replaceChildren();
      try { await W.ask("job", { steps: [] }); } catch (error) { fault.replaceChildren(W.fault(error)); bar.refresh(W.job); }
    } });
    const stop = W.make("button", { type: "button", text: W.word("stop"), onclick: () => W.ask("job", undefined, "DELETE") });
    const bar = W.make("div", { class: "wb-run" }, run, stop, text, fault);
    bar.put = (current) => { view = current; bar.refresh(W.job); };
    bar.refresh = (job) => {
      const isRunning = job && job.state === "running";
      run.disabled = !job || isRunning || // before the first answer nobody knows whether one runs
        !view.data.steps.length || W.isExport;
      stop.hidden = !isRunning;
      text.textContent = isRunning ? W.jobWords(job) : view.data.waiting
        ? W.word("to.run", { n: view.data.waiting, s: W.number(view.data.seconds_to_run, 2) }) : W.word("nothing.to.run");
    };
    return bar;
  }

  function chainSection(view) {
    const bar = runBar(), inside = W.make("div"), section = W.section(W.word("chain"), bar, inside);
    section.refresh = ({ data }) => {
      const steps = data.steps.map(({ age_s: age, ...step }) => step);
      bar.put({ data });
      W.fillParts(inside, [["chain", [steps, data.links], () => {
        const [box, show] = stepBox({ data });
        return W.make("div", {}, W.chainPicture(data.steps, data.links, show), box);
      }]]);
    };
    section.refresh(view);
    return section;
  }

  W.views.project = {
    title: () => W.word("view.project"),
    show(place, view) {
      this.refresh = (job) => { const bar = place.querySelector(".wb-run"); if (bar) bar.refresh(job); };
      const data = view.data, [title, answer, doubts] = W.head(view, data.name), head = [["title", data.name, () => title],
        ["answer", [view.answer, view.is_stale], () => answer], ["doubts", view.doubts, () => doubts]];
      const same = ["same", [view.commands, view.calls], () => W.same(view)];
      if (data.is_empty) { W.fillParts(place, [...head, ["begins", "", () => W.begins()], same]); return; }
      const list = (lines) => W.make("ol", {}, lines.map((text) => W.make("li", W.spoken(text)))), missing = data.absent_parts;
      const others = data.answers.slice(1);
      W.fillParts(place, [...head, ...(others.length ? [["others", [others, view.is_stale], () => W.make("div", { class: "summary" },
        others.map((text) => W.make("p", { class: view.is_stale ? "wb-old" : null, ...W.spoken(text) })))]] : []),
      ["chain", "", () => chainSection(view), (node) => node.refresh(view)],
      ...(Object.keys(data.goals).length ? [["limits", data.goals, () => limits(data.goals)]] : []),
      ...(data.next_steps.length ? [["next", data.next_steps, () => W.section(W.word("next"), list(data.next_steps))]] : []),
      ...(missing.length ? [["missing", missing, () => W.section(W.word("missing"), W.make("ul", {}, missing.map((text) => W.make("li", W.spoken(text)))))]] : []),
      ...(W.isExport ? [] : [["intake", "", () => W.intake(view), (node) => node.refresh(view)]]), same]);
    },
  };
})(window.Workbench);
