// Remembers in the browser which session is whose, finds it again, and asks before results are left.
// The tab knows its own session (a reload comes back to it); the browser knows those of tabs that
// were closed. Open pages are asked which of them they hold.
const ANSWERING = 300; // ms that other pages have to say that they are there
const BEAT = 10000; // ms between two signs of life
const MOST = 5; // sessions that are remembered

const home = `heartgen ${window.location.pathname}`;
const safely = (act, otherwise = null) => {
  try {
    return act();
  } catch {
    return otherwise; // the browser keeps nothing: every page is a new one
  }
};
const own = () => safely(() => sessionStorage.getItem(home));
const known = () => safely(() => JSON.parse(localStorage.getItem(home)) || [], []);
const remember = (key) => safely(() => {
  sessionStorage.setItem(home, key);
  localStorage.setItem(home, JSON.stringify([key, ...known().filter((k) => k !== key)].slice(0, MOST)));
});
const forget = (key) => safely(() => {
  sessionStorage.removeItem(home);
  localStorage.setItem(home, JSON.stringify(known().filter((k) => k !== key)));
});

function render({ model, el }) {
  const channel = new BroadcastChannel(home);
  const notice = document.createElement("p");
  notice.className = "hg-gone hg-elsewhere";
  notice.setAttribute("role", "alert");
  notice.hidden = true;
  notice.append("This session goes on in another window. ");
  const here = document.createElement("button");
  here.type = "button";
  here.textContent = "Bring it here";
  here.addEventListener("click", () => window.location.reload());
  notice.append(here);
  el.appendChild(notice);

  let key = null;
  let leaving = false;
  const held = new Set();
  channel.addEventListener("message", ({ data }) => {
    if (data.ask && key && notice.hidden) channel.postMessage({ held: key });
    if (data.held) held.add(data.held);
    if (data.taken && data.taken === key) notice.hidden = false;
  });
  channel.postMessage({ ask: true });
  const reloaded = performance.getEntriesByType("navigation")[0]?.type === "reload";
  const greet = setTimeout(() => {
    const mine = own();
    const others = known().filter((k) => k !== mine);
    model.send({
      kind: "hello",
      mine: mine && (reloaded || !held.has(mine)) ? mine : "",
      left: others.filter((k) => !held.has(k)),
      address: window.location.origin + window.location.pathname,
    });
  }, ANSWERING);

  const hear = (message) => {
    if (message.kind === "key") {
      key = message.key;
      remember(key);
      channel.postMessage({ taken: key });
    }
    if (message.kind === "elsewhere") notice.hidden = false;
    if (message.kind === "anew") {
      forget(key);
      leaving = true;
      window.location.assign(window.location.pathname);
    }
  };
  model.on("msg:custom", hear);
  const beat = setInterval(() => safely(() => model.send({ kind: "beat" })), BEAT);

  // Before Voila's own, which would end the page's connection even if the visitor stays.
  const ask = (event) => {
    if (leaving || !notice.hidden || !model.get("unsaved")) return;
    event.preventDefault();
    event.returnValue = true;
    event.stopImmediatePropagation();
  };
  window.addEventListener("beforeunload", ask, { capture: true });
  return () => {
    clearTimeout(greet);
    clearInterval(beat);
    channel.close();
    window.removeEventListener("beforeunload", ask, { capture: true });
    model.off("msg:custom", hear);
  };
}
export default { render };
