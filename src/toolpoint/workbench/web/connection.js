"use strict";
// Connection to the server: the token becomes a cookie once, requests, and events that go on after a break.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const exported = window.workbenchExport; // a folder that opens without a server
  W.isExport = Boolean(exported);
  W.exportedPage = (name) => exported.pages[name] || "#";

  W.asset = async (name) => exported ? exported.assets[name] : (await fetch("/web/" + name)).json();

  W.begin = async function () {
    const match = /[#&]token=([\w-]+)/.exec(location.hash);
    if (!match || exported) return;
    await fetch("/api/session", { method: "POST", headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ token: match[1] }) });
    // The view that the address names stays, and one that a person went to in the meantime.
    const named = /^#\/([\w-]+)/.exec(location.hash);
    if (/[#&]token=/.test(location.hash)) history.replaceState(null, "", location.pathname + "#/" + (named ? named[1] : "project"));
  };

  W.ask = async function (path, body, method) {
    if (exported) return exported.answer(path, body);
    const kind = method || (body === undefined ? "GET" : "POST");
    const options = { method: kind, headers: {} };
    if (kind === "POST") { options.headers["Content-Type"] = "application/json"; options.body = JSON.stringify(body); }
    let response;
    try { response = await fetch("/api/" + path, options); } catch (error) { W.say(W.word("link.lost")); throw error; }
    if (response.status === 401) { W.say(W.word("link.token")); throw new Error(W.word("link.token")); }
    const text = await response.text();
    let data = {};
    try { data = text ? JSON.parse(text) : {}; } catch (error) { data = { error: text }; }
    if (!response.ok) throw new Error(data.error || response.status + " " + response.statusText);
    return data;
  };

  W.say = function (text) {
    const line = document.getElementById("wb-link");
    line.textContent = text || "";
    line.hidden = !text;
  };

  const listeners = {};
  W.on = (name, act) => { (listeners[name] = listeners[name] || []).push(act); };
  const tell = (name, data) => { for (const act of listeners[name] || []) act(data); };

  // One stream a tab, closed while the tab is hidden: browsers allow few connections to a host.
  let source = null;
  W.listen = function () {
    if (exported) return;
    const open = () => {
      if (source || document.hidden) return;
      source = new EventSource("/api/events");
      source.onopen = () => { W.say(""); tell("open", {}); };
      source.onerror = () => W.say(W.word("link.lost"));
      for (const name of ["step", "job", "recording", "changed", "reset"])
        source.addEventListener(name, (event) => tell(name, JSON.parse(event.data)));
    };
    document.addEventListener("visibilitychange", () => {
      if (document.hidden && source) { source.close(); source = null; } else { open(); }
    });
    window.addEventListener("pagehide", () => { if (source) { source.close(); source = null; } });
    open();
  };

  // One request in flight; of those that wait only the newest is sent: a slider never runs ahead of its answers.
  W.latest = function (send, show, fail) {
    let isBusy = false, waiting = null;
    const go = async (value) => {
      isBusy = true;
      try { show(await send(value), value); } catch (error) { if (fail) fail(error); }
      isBusy = false;
      if (waiting !== null) { const next = waiting; waiting = null; go(next); }
    };
    return (value) => { if (isBusy) waiting = value; else go(value); };
  };
})(window.Workbench);
