// Remembers in the browser which session is whose, finds it again, and asks before results are left.
// The tab knows its own session (a reload comes back to it); the browser knows those of tabs that
// were closed. An open page holds a lock for its session, which the browser gives back whatever becomes
// of the page. Where there are no locks (http from another machine), open pages are asked.
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

const locks = navigator.locks;
const lock = (key) => `${home} ${key}`;
const locked = async () => {
  const state = locks ? await locks.query() : { held: [] };
  return new Set(state.held.map((each) => each.name));
};

// Voila ends kernel and connection as soon as the page may be left, even if the visitor then stays:
// have it wait until they are gone.
const leaveInTime = (kernel) => {
  if (document.body.dataset.voila !== "voila" || !kernel) return;
  const send = navigator.sendBeacon.bind(navigator);
  const waiting = new Map();
  navigator.sendBeacon = (url, data) => {
    if (!String(url).includes("/voila/api/shutdown/")) return send(url, data);
    waiting.set(String(url), data);
    return true;
  };
  kernel.dispose = () => {}; // a page that is gone has no connection
  window.addEventListener("pagehide", () => waiting.forEach((data, url) => send(url, data)));
};

function render({ model, el }) {
  safely(() => leaveInTime(model.widget_manager.kernel));
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
  const way = performance.getEntriesByType("navigation")[0]?.type;
  const reloaded = way === "reload";
  const greet = setTimeout(async () => {
    const taken = await locked().catch(() => new Set());
    const free = (k) => !held.has(k) && !taken.has(lock(k));
    const mine = own();
    model.send({
      kind: "hello",
      mine: mine && (reloaded || free(mine)) ? mine : "",
      left: known().filter((k) => k !== mine && free(k)),
      address: window.location.origin + window.location.pathname,
      again: reloaded || way === "back_forward",
    });
  }, ANSWERING);
  const lost = () => { notice.hidden = false; };
  const hold = () => {
    locks?.request(lock(key), { steal: true }, () => new Promise(() => {})).catch(lost);
  };

  const hear = (message) => {
    if (message.kind === "key") {
      if (key === message.key) return;
      key = message.key;
      remember(key);
      hold();
      channel.postMessage({ taken: key });
    }
    if (message.kind === "elsewhere") lost();
    if (message.kind === "anew") {
      forget(key);
      leaving = true;
      window.location.assign(window.location.pathname);
    }
  };
  model.on("msg:custom", hear);
  const beat = setInterval(() => safely(() => model.send({ kind: "beat" })), BEAT);

  const ask = (event) => {
    if (leaving || !notice.hidden || !model.get("unsaved")) return;
    event.preventDefault();
    event.returnValue = true;
  };
  window.addEventListener("beforeunload", ask);
  return () => {
    clearTimeout(greet);
    clearInterval(beat);
    channel.close();
    window.removeEventListener("beforeunload", ask);
    model.off("msg:custom", hear);
  };
}
export default { render };
