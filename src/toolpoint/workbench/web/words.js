"use strict";
// Words of the page by key: English complete, another language where it has the key.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const LANGUAGES = { en: "English", de: "Deutsch", fr: "Français" };
  const TRANSLATED = ["de"]; // languages with a catalogue of sentences
  let english = {}, chosen = {}, sentences = [];

  W.language = function () {
    const kept = localStorage.getItem("toolpoint-language");
    if (kept && LANGUAGES[kept]) return kept;
    const first = (navigator.language || "en").slice(0, 2);
    return LANGUAGES[first] ? first : "en";
  };

  W.word = function (key, values) {
    let text = chosen[key] || english[key] || key;
    for (const [name, value] of Object.entries(values || {})) text = text.replaceAll("{" + name + "}", String(value));
    return text;
  };

  // What the package said, in the language of the page where its catalogue has every part of it; else as it was said.
  // A template is a sentence with places for numbers and names; a longer text is taken apart at its sentences, at the remedy
  // (after "; ") and at the part that a doubt is about (before ": "), which is a name or stands in the catalogue too.
  // {z} stands for a sentence that must stand in the catalogue itself, {l} for a list, any other
  // letter for a number or a name: no sentence ends in it. {m} and {n} are of what a doubt is about: no colon stands in them.
  const PLACE = "(?:(?!; |[.?!] [A-Z0-9]).)+?";
  const PLACES = { z: ".+", l: ".+?", m: "[^:;]+?", n: "[^:;]+?" };
  const LONGEST_NAME = 60; // letters of what a doubt is about, where no catalogue knows it
  const SPLITS = [[/(?<=[.?!]) (?=[A-Z0-9])/, " "], [/; /, "; "]];
  function translate(text) {
    for (const [pattern, template] of sentences) {
      const match = pattern.exec(text);
      if (!match || (match.groups && match.groups.z && translate(match.groups.z) === null)) continue;
      return template.replace(/\{(\w)\}/g, (whole, name) => translate(match.groups[name]) ?? match.groups[name]);
    }
    for (const [mark, joint] of SPLITS) {
      const parts = text.split(mark);
      if (parts.length < 2) continue;
      const all = parts.map(translate);
      if (all.every((part) => part !== null)) return all.join(joint);
    }
    const colon = text.indexOf(": "), rest = colon > 0 && colon < LONGEST_NAME && !text.slice(0, colon).includes("; ") ? translate(text.slice(colon + 2)) : null;
    if (rest === null && text.endsWith(".")) { const said = translate(text.slice(0, -1)); return said === null ? null : said + "."; }
    return rest === null ? null : `${translate(text.slice(0, colon)) ?? text.slice(0, colon)}: ${rest}`;
  }
  // The shape view is that of the reports, which are English: here it asks for its words.
  window.ToolpointSay = (text) => chosen["shape." + text] || english["shape." + text] || text;

  W.spoken = function (text) {
    const words = sentences.length ? translate(text.replaceAll(" .. ", " … ")) : null; // pages write an interval so
    return words === null ? { text, lang: "en" } : { text: words, lang: W.language() };
  };
  function readSentences(pairs) {
    const plain = (part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
    sentences = pairs.map(([said, words]) => [new RegExp("^" + said.split(/\{(\w)\}/).map((part, i) => i % 2 ? `(?<${part}>${PLACES[part] || PLACE})` : plain(part)).join("") + "$"), words]);
  }

  W.loadWords = async function () {
    const language = W.language();
    if (TRANSLATED.includes(language)) readSentences(await W.asset(`sentences_${language}.json`));
    const names = language === "en" ? ["en"] : ["en", language]; // one request less for most
    [english, chosen = english] = await Promise.all(names.map((name) => W.asset(`words_${name}.json`)));
    document.documentElement.lang = language;
    for (const node of document.querySelectorAll("[data-word]")) node.textContent = W.word(node.dataset.word);
    const list = document.getElementById("wb-language");
    list.replaceChildren(...Object.entries(LANGUAGES).map(([value, text]) =>
      W.make("option", { value, text, ...(value === language ? { selected: "" } : {}) })));
    list.onchange = () => { localStorage.setItem("toolpoint-language", list.value); location.reload(); };
  };
})(window.Workbench);
