"use strict";
// Words of the page by key: English complete, another language where it has the key.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const LANGUAGES = { en: "English", de: "Deutsch", fr: "Français" };
  let english = {}, chosen = {};

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

  W.loadWords = async function () {
    const language = W.language();
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
