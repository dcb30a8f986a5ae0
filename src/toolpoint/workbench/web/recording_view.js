"use strict";
// Recording of blows: settings, start and end, every blow with its verdict at once, responses that build up, the sound of a blow.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  let settings = null, state = null, parts = null, asked = false;
  const drawn = {};

  // The sound of a blow, its words, and the pulse of its force, into a place of the page.
  W.hearBlow = async function (place, test, blow, isRecording) {
    try {
      const answer = await W.ask("pulse", { test, blow, is_recording: isRecording });
      const play = () => W.playSound(W.floats(answer.sound), answer.rate), pulse = W.floats(answer.pulse);
      const chart = new W.LineChart({ x: W.word("time.ms"), y: W.word("force"), height: 150, label: W.word("pulse.label", { blow }) });
      chart.set({ lines: [{ x: Array.from(pulse, (_, i) => 1e3 * i / answer.pulse_rate), y: Array.from(pulse), name: blow, kind: "now" }] });
      const same = W.make("details", { class: "wb-same" }, W.make("summary", { text: W.word("same") }));
      W.fillSame(same, [], answer.calls);
      place.replaceChildren(W.make("p", { id: "wb-pulse", text: answer.words }), W.doubts(answer.doubts), chart.node,
        W.make("p", {}, W.make("button", { type: "button", text: W.word("play"), onclick: play }), W.make("span", { class: "key", text: " " + W.word("pulse.key") })), same);
      W.pulse = answer; play();
    } catch (error) { place.replaceChildren(W.fault(error)); }
  };

  const field = (id, label, node) => W.make("label", { for: id }, W.make("span", { text: label }), node);
  const numberOf = (node) => node.value.trim() === "" ? null : Number(node.value);

  function form(view, place) {
    settings = settings || view.data.example;
    const text = (id, value, more) => W.make("input", { id, type: "text", value, spellcheck: "false", ...more });
    const name = text("rec-name", settings.name), device = text("rec-device", settings.device, { list: "rec-devices" });
    const blows = text("rec-blows", settings.blows, { inputmode: "numeric" }), block = text("rec-block", settings.block, { inputmode: "decimal" });
    const rate = text("rec-rate", settings.rate || "", { inputmode: "decimal" });
    const channels = W.make("textarea", { id: "rec-channels", rows: "3", spellcheck: "false" });
    channels.value = channels.defaultValue = settings.channels.join("\n");
    const read = () => { settings = { name: name.value, device: device.value, blows: numberOf(blows), block: numberOf(block), rate: numberOf(rate),
      channels: channels.value.split("\n").map((line) => line.trim()).filter(Boolean) }; return settings; };
    for (const node of [name, device, blows, block, rate, channels]) node.addEventListener("input", read);
    const start = W.make("button", { type: "button", id: "rec-start", text: W.word("rec.start"), onclick: () => act("POST", read()) });
    // Nothing is known to run before the first state arrives: a press on this button would meet no recording.
    const stop = W.make("button", { type: "button", id: "rec-stop", text: W.word("rec.stop"), disabled: "", onclick: () => act("DELETE") });
    const act = async (method, body) => {
      start.disabled = stop.disabled = true;
      parts.fault.replaceChildren();
      try { await W.ask("recording", body, method); } catch (error) { parts.fault.replaceChildren(W.fault(error)); }
      await follow();
    };
    const list = W.make("datalist", { id: "rec-devices" }, ["sound", "ni:Dev1", "folder:incoming_records", "play:FILE"].map((value) => W.make("option", { value })));
    Object.assign(parts, { start, stop });
    return W.make("form", { class: "wb-form", "data-kept": "", onsubmit: (event) => event.preventDefault() },
      W.make("div", { class: "wb-fields" }, field("rec-name", W.word("rec.name"), name), field("rec-device", W.word("rec.device"), device),
        field("rec-blows", W.word("rec.blows"), blows), field("rec-block", W.word("rec.block"), block), field("rec-rate", W.word("rec.rate"), rate)), list,
      field("rec-channels", W.word("rec.channels"), channels), W.make("p", { class: "key", text: W.word("rec.key") }),
      W.make("div", { class: "wb-run" }, start, stop));
  }

  async function decide(blow, accept) {
    try { parts.decided.textContent = W.word("rec.decided", { text: (await W.ask("recording/decision", { blow, accept })).command }); }
    catch (error) { parts.fault.replaceChildren(W.fault(error)); }
    await follow();
  }

  // Verdicts of the study of all blows prevail over those spoken at once: blows are compared with each other.
  function rowOf(blow, verdicts) {
    const hit = verdicts.get(blow.name), accepted = hit ? hit.accepted : blow.accepted, byHand = hit && hit.by_hand;
    const reasons = [...(hit ? hit.reasons : blow.reasons), ...blow.remarks];
    const button = (key, act, id) => W.make("button", { type: "button", text: W.word(key), "aria-label": `${W.word(key)} ${blow.name}`, id, onclick: act });
    return [blow.name.replace(/\.npz$/, ""), W.number(blow.force_n, 4), W.make("span", { class: "mark " + (accepted ? "good" : "doubtful"),
      text: W.word(accepted ? "accepted" : "refused") + (byHand ? ", " + W.word("by.hand") : "") }), reasons.join("; "),
    W.make("span", { class: "wb-row" }, blow.is_counted ? button(accepted ? "refuse" : "accept", () => decide(blow.name, !accepted), `rec-decide-${blow.name}`) : null,
      blow.is_counted ? button("rec.hear", () => W.hearBlow(parts.heard, state.settings.name, blow.name, true), `rec-hear-${blow.name}`) : null)];
  }

  function show() {
    if (!parts || !state) return;
    const study = state.study, last = state.blows.at(-1), verdicts = new Map((study ? study.hits : []).map((hit) => [hit.name, hit]));
    parts.start.disabled = state.is_running; parts.stop.disabled = !state.is_running;
    parts.state.textContent = W.word("rec.state." + (state.state || "none"), { name: state.settings ? state.settings.name : "" })
      + (state.remaining === null ? "" : " " + W.word("rec.remaining", { n: state.remaining }));
    parts.state.dataset.state = state.state;
    parts.last.textContent = last ? last.words : "";
    parts.last.className = "wb-last" + (last && !last.accepted ? " wb-bad" : "");
    parts.words.replaceChildren(...state.words.map((text) => W.make("li", { text })));
    parts.doubts.replaceChildren(W.doubts([...state.doubts, ...(study ? study.doubts : [])]));
    const key = JSON.stringify([state.blows, study && study.hits]);
    if (drawn.rows !== key) { // a button under the finger stays
      drawn.rows = key;
      parts.rows.replaceChildren(state.blows.length ? W.table([W.word("blow"), W.word("force"), W.word("verdict"), W.word("reasons"), ""],
        [...state.blows].reverse().map((blow) => rowOf(blow, verdicts))) : W.make("p", { class: "key", text: W.word("rec.no.blow") }));
    }
    parts.responses.hidden = !study;
    parts.study.textContent = study ? study.status : "";
    if (study) {
      parts.response.set({ lines: [{ x: study.frequency_hz, y: study.size, name: `${study.output} / ${study.input}`, kind: "now" }], label: study.status });
      parts.coherence.set({ lines: study.coherence ? [{ x: study.frequency_hz, y: study.coherence, name: W.word("coherence"), kind: "now" }] : [], range: { y0: 0, y1: 1.02 } });
    }
    parts.enter.hidden = state.is_running || !study || parts.entered.includes(state.settings.name);
    if (state.commands.length) W.fillSame(parts.same, state.commands, state.calls);
    document.body.dataset.recording = `${state.state} ${state.blows.length}`;
  }

  async function follow() { // one question at a time; what changes meanwhile is asked for once more
    if (!parts) return;
    if (asked) { asked = "again"; return; }
    do { asked = true; try { state = await W.ask("recording"); show(); } catch (error) { /* the link says so */ } } while (asked === "again");
    asked = false;
  }

  async function enter() {
    const name = state.settings.name, value = `{test: ${state.settings.folder}/test.yaml}`;
    try {
      await W.ask("part", { place: `tests.${name}`, value });
      parts.decided.textContent = W.word("rec.entered", { text: `toolpoint add . --part 'tests.${name}: ${value}'` });
      parts.entered.push(name); show();
    } catch (error) { parts.fault.replaceChildren(W.fault(error)); }
  }

  W.views.record = {
    title: () => W.word("view.record"),
    show(place, view) {
      drawn.rows = "";
      const chart = (y, height, label, logY) => new W.LineChart({ x: W.word("frequency") + ", Hz", y, logY, height, label });
      // What a person was told or hears stays through a redraw, and the state is shown before it is asked for again.
      const { fault = W.make("div"), heard = W.make("div"), decided = W.make("p", { class: "key", role: "status", id: "rec-decided" }) } = parts || {};
      parts = { fault, heard, decided, entered: [...view.data.entered], state: W.make("p", { id: "rec-state", role: "status" }), last: W.make("p", { id: "rec-last", "aria-live": "assertive" }),
        words: W.make("ul"), doubts: W.make("div"), rows: W.make("div", { id: "rec-rows" }),
        study: W.make("p", { id: "rec-study" }), response: chart(W.word("rec.size"), 240, W.word("rec.size"), true), coherence: chart(W.word("coherence"), 130, W.word("coherence"), false) };
      parts.responses = W.section(W.word("rec.responses"), parts.study, parts.response.node, parts.coherence.node);
      parts.enter = W.make("div", { class: "wb-run", hidden: "" }, W.make("button", { type: "button", id: "rec-enter", text: W.word("rec.enter"), onclick: enter }));
      parts.same = W.same(view);
      place.replaceChildren(...W.head(view, W.word("view.record")), form(view, place), parts.fault, parts.doubts, W.section(W.word("rec.blow.now"), parts.state, parts.last),
        W.make("div", { class: "wb-two" }, W.section(W.word("view.blows"), parts.rows, parts.decided, parts.heard, parts.enter), parts.responses),
        W.section(W.word("rec.what"), W.make("details", {}, W.make("summary", { text: W.word("rec.words") }), W.make("div", { class: "wb-inside" }, parts.words))), parts.same);
      show();
      follow();
    },
  };
  W.on("recording", () => { if (W.current === "record") follow(); });
  W.on("reset", () => { if (W.current === "record") follow(); });
})(window.Workbench);
