"use strict";
// What a project is given: begun in an empty folder, files dropped in and told, cuts and goals, cuts that were tried.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const SENT_AT_ONCE = 4; // files on their way at the same time

  W.begins = () => W.make("p", {}, W.make("button", { type: "button", class: "wb-main", id: "wb-begin", text: W.word("begin"),
    onclick: W.onceAtATime(async () => { await W.ask("begin", {}); location.hash = "#/project"; W.open(false); }) }));

  function form(title, fields, button, act) {
    const inputs = fields.map(([id, label, value, options]) => options
      ? W.make("select", { id }, options.map((text) => W.make("option", { value: text, text })))
      : W.make("input", { type: "text", id, value }));
    const said = W.make("p", { role: "status", class: "key" });
    const send = W.make("button", { type: "submit", text: button });
    const node = W.make("form", { class: "wb-form", "aria-label": title, onsubmit: async (event) => {
      event.preventDefault();
      said.className = "key";
      try { said.textContent = await act(Object.fromEntries(inputs.map((input) => [input.id, input.value.trim()]))) || ""; }
      catch (error) { said.textContent = error.message; said.className = "wb-fault"; }
    } }, W.make("h3", { text: title }), W.make("div", { class: "wb-fields" }, fields.map(([id, label], i) => W.make("label", { for: id, text: label }, inputs[i]))),
    W.make("p", {}, send), said);
    return node;
  }

  const part = async (place, value) => {
    const { named } = await W.ask("part", { place, value });
    return [W.word("entered", { text: `toolpoint add . --part '${place}: ${value}'` }), ...(named.length ? [W.word("cut.named", { text: named.join("; ") })] : [])].join(" ");
  };

  function cutForm() {
    return form(W.word("new.cut"), [["cut-name", W.word("name"), "face"], ["cut-diameter", W.word("diameter"), "50 mm"], ["cut-teeth", W.word("teeth"), "5"],
      ["cut-immersion", W.word("immersion"), "0.6"], ["cut-kt", "K_t", "1900 MPa"], ["cut-kn", "K_n", "700 MPa"], ["cut-deviation", W.word("deviation"), "8 %"],
      ["cut-speeds", W.word("speeds"), "500 2500 rpm"]], W.word("enter"), (v) => part(`cuts.${v["cut-name"]}`,
      `{diameter: ${v["cut-diameter"]}, teeth: ${v["cut-teeth"]}, immersion: ${v["cut-immersion"]}, tangential: ${v["cut-kt"]}, normal: ${v["cut-kn"]}, ` +
      `coefficient_deviation: ${v["cut-deviation"]}, speeds: ${v["cut-speeds"]}}`));
  }

  // The cuts to choose from follow the project; the form is the same node, and what is typed in it stays.
  function goalForm(view) {
    let cuts = view.data.parts.cuts;
    const node = form(W.word("new.goal"), [["goal-name", W.word("name"), "as tested"], ["goal-cut", W.word("cut"), "", cuts], ["goal-speed", W.word("spindle"), "1200 rpm"],
      ["goal-depth", W.word("depth.unit"), "3 mm"], ["goal-pose", W.word("pose"), ""]], W.word("enter"), (v) => part(`goals.${v["goal-name"]}`,
      `{${v["goal-cut"] ? `cut: ${v["goal-cut"]}, ` : ""}speed: ${v["goal-speed"]}, depth: ${v["goal-depth"]}${v["goal-pose"] ? `, pose: {${v["goal-pose"]}}` : ""}}`));
    node.refresh = (current) => {
      const names = current.data.parts.cuts, select = node.querySelector("#goal-cut"), chosen = select.value;
      if (names.join("\n") === cuts.join("\n")) return;
      cuts = names;
      select.replaceChildren(...names.map((text) => W.make("option", { value: text, text, selected: text === chosen })));
    };
    return node;
  }

  function triedForm() {
    return form(W.word("new.tried"), [["tried-speed", W.word("speed"), ""], ["tried-depth", W.word("depth"), ""], ["tried-outcome", W.word("outcome"), "", ["stable", "chatter"]],
      ["tried-hz", W.word("heard"), ""]], W.word("report"), async (v) => {
      await W.ask("tried", { speed_rpm: Number(v["tried-speed"]), depth_m: Number(v["tried-depth"]) / 1e3, stable: v["tried-outcome"] === "stable", frequency_hz: Number(v["tried-hz"]) });
      const outcome = v["tried-outcome"] === "stable" ? "--stable" : `--chatter ${Number(v["tried-hz"]) || 0}`;
      return W.word("entered", { text: `toolpoint tried . --speed ${v["tried-speed"]} --depth ${v["tried-depth"]} ${outcome}` });
    });
  }

  // The components file as text: its draft names the measured points; what a person has typed stays.
  function componentsForm(text) {
    const field = W.make("textarea", { id: "components-text", rows: 18, spellcheck: "false", "aria-label": W.word("new.components") });
    const said = W.make("p", { role: "status", class: "key" });
    field.value = text;
    const node = W.make("form", { class: "wb-form", "aria-label": W.word("new.components"), onsubmit: async (event) => {
      event.preventDefault();
      try { said.textContent = W.word("written", { file: (await W.ask("components", { text: field.value })).file }); said.className = "key"; text = field.value; }
      catch (error) { said.textContent = error.message; said.className = "wb-fault"; }
    } }, W.make("p", { class: "key", text: W.word("components.key") }), field, W.make("p", {}, W.make("button", { type: "submit", text: W.word("enter") })), said);
    node.refresh = (current) => { if (field.value === text) field.value = text = current; };
    return node;
  }

  // A test of records that do not say what their channels are: drafted from names and columns; what a person has typed stays.
  function testForm() {
    let shown = "";
    const fields = { name: "text", of: ["structure", "tip x", "tip y"], records: "text", pattern: "text", struck: "text", channels: "area" };
    const inputs = Object.fromEntries(Object.entries(fields).map(([key, kind]) => [key, Array.isArray(kind)
      ? W.make("select", { id: "test-" + key }, kind.map((value) => W.make("option", { value, text: W.word("test.of." + value.replace(" ", ".")) })))
      : kind === "area" ? W.make("textarea", { id: "test-" + key, rows: 5, spellcheck: "false" }) : W.make("input", { type: "text", id: "test-" + key })]));
    const lines = (text) => text.split("\n").map((line) => line.trim()).filter(Boolean), said = W.make("p", { role: "status", class: "key" });
    const node = W.make("form", { class: "wb-form", "aria-label": W.word("new.test"), onsubmit: async (event) => {
      event.preventDefault();
      if (node.dataset.sent) return; // until it is answered
      node.dataset.sent = "1"; said.className = "key"; said.textContent = W.word("loading");
      const { name, of, records, pattern, struck, channels } = inputs;
      try {
        const answer = await W.ask("test", { name: name.value.trim(), of: of.value, records: records.value.split(",").map((text) => text.trim()).filter(Boolean),
          pattern: pattern.value.trim(), struck: struck.value.trim(), channels: lines(channels.value) });
        said.textContent = W.word("entered", { text: `toolpoint add . --part '${answer.entered}'` });
      } catch (error) { said.textContent = error.message; said.className = "wb-fault"; } finally { delete node.dataset.sent; }
    } }, W.make("p", { class: "key", text: W.word("test.key") }),
    W.make("div", { class: "wb-fields" }, Object.keys(fields).filter((key) => key !== "channels").map((key) => W.make("label", { for: "test-" + key, text: W.word("test." + key) }, inputs[key]))),
    W.make("label", { for: "test-channels", text: W.word("test.channels") }, inputs.channels), W.make("p", {}, W.make("button", { type: "submit", id: "test-enter", text: W.word("enter") })), said);
    node.refresh = (draft) => {
      const text = JSON.stringify(draft);
      if (!draft || text === shown) return;
      shown = text;
      for (const [key, value] of Object.entries(draft)) inputs[key].value = key === "channels" ? value.join("\n") : Array.isArray(value) ? value.join(", ") : value;
    };
    return node;
  }

  async function handOver(files, said) {
    let sent = 0, waiting = [...files];
    const faults = [];
    const one = async () => {
      while (waiting.length) {
        const file = waiting.shift();
        try {
          const response = await fetch("/api/file/" + encodeURIComponent(file.name), { method: "PUT", headers: { "Content-Type": "application/octet-stream" }, body: file });
          if (!response.ok) { const text = await response.text(); let words = text; try { words = JSON.parse(text).error; } catch (error) { /* plain text */ } faults.push(`${file.name}: ${words}`); }
        } catch (error) { faults.push(`${file.name}: ${error.message}`); }
        said.textContent = W.word("handed", { n: ++sent, total: files.length });
      }
    };
    await Promise.all(Array.from({ length: SENT_AT_ONCE }, one));
    if (faults.length) said.textContent += "\n" + faults.join("\n");
    said.className = faults.length ? "wb-fault" : "key";
  }

  function confirmList(files, kinds, done) {
    if (!files.length) return W.make("div");
    const groups = {}; // 200 records are one line; a table among them is one of its own
    for (const file of files) {
      const key = `${file.kind}|${file.is_sure}|${file.file.split(".").pop().toLowerCase()}`;
      (groups[key] = groups[key] || []).push(file);
    }
    const chosen = {};
    const rows = Object.values(groups).map((group) => {
      const select = W.make("select", { "aria-label": W.word("kind.of", { file: group[0].file }), onchange: () => group.forEach((file) => { chosen[file.file] = select.value; }) },
        Object.entries(kinds).map(([kind, words]) => W.make("option", { value: kind, ...W.spoken(words), selected: kind === group[0].kind })));
      group.forEach((file) => { chosen[file.file] = file.kind; });
      const names = group.map((file) => file.file), words = names.length > 4 ? `${names.slice(0, 3).join(", ")} … (${names.length})` : names.join(", ");
      return [words, select, W.word(group[0].is_sure ? "sure" : "guess")];
    });
    const said = W.make("span", { role: "status" });
    return W.make("div", {}, W.make("p", { text: W.word("told", { n: files.length }) }), W.table([W.word("file"), W.word("is"), ""], rows),
      W.make("p", {}, W.make("button", { type: "button", class: "wb-main", id: "wb-confirm", text: W.word("confirm"), onclick: W.onceAtATime(async () => {
        try { done(await W.ask("intake", { kinds: chosen })); } catch (error) { said.textContent = error.message; said.className = "wb-fault"; }
      }) }), " ", said));
  }

  W.intake = function (view) {
    const said = W.make("p", { class: "key", role: "status" }), list = W.make("div"), entered = W.make("div", { class: "wb-entered" });
    let shown = "", underway = 0;
    const fill = async () => {
      const { files } = await W.ask("intake"), text = JSON.stringify(files);
      if (underway || text === shown) return; // half of the files are not to be confirmed; kinds that a person has chosen stay
      shown = text;
      list.replaceChildren(confirmList(files, view.data.kinds, (answer) => {
        W.entered = answer;
        entered.replaceChildren(W.make("p", { class: "key", text: W.word("entered.files", { n: answer.places.length }) }),
          W.doubts(answer.doubts), W.make("ul", {}, answer.parts.map((text) => W.make("li", { text }))));
        fill();
      }));
    };
    const take = async (files) => { if (files.length) { underway += 1; try { await handOver([...files], said); } finally { underway -= 1; } fill(); } };
    const input = W.make("input", { type: "file", multiple: true, id: "wb-files", onchange: () => take(input.files) });
    const drop = W.make("div", { class: "wb-drop" }, W.make("label", { for: "wb-files", text: W.word("drop") + " " }), input);
    drop.addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
    drop.addEventListener("dragleave", () => drop.classList.remove("over"));
    drop.addEventListener("drop", (event) => { event.preventDefault(); drop.classList.remove("over"); take(event.dataTransfer.files); });
    const goal = goalForm(view), inside = W.make("div", { class: "wb-inside" }, cutForm(), goal);
    const components = componentsForm(view.data.components_text || "");
    const block = W.make("details", {}, W.make("summary", { text: W.word("new.components") }), components);
    const test = testForm(), testBlock = W.make("details", {}, W.make("summary", { text: W.word("new.test") }), W.make("div", { class: "wb-inside" }, test));
    const section = W.section(W.word("give"), drop, said, list, entered, testBlock, block, W.make("details", {}, W.make("summary", { text: W.word("cuts.and.goals") }), inside));
    section.dataset.kept = "";
    section.refresh = (current) => {
      goal.refresh(current);
      if (current.data.test_draft && !testBlock.dataset.asked) { // once: a person may fold it; after the redraw, which puts back what was open
        testBlock.dataset.asked = "1"; setTimeout(() => { testBlock.open = true; }, 0);
      }
      testBlock.hidden = !current.data.test_draft && !test.querySelector("[role=status]").textContent;
      test.refresh(current.data.test_draft);
      block.hidden = current.data.components_text === null;
      if (!block.hidden) components.refresh(current.data.components_text);
      if (current.data.answers.length && !inside.querySelector("#tried-speed")) inside.append(triedForm());
      fill().catch(() => {});
    };
    section.refresh(view);
    return section;
  };
})(window.Workbench);
