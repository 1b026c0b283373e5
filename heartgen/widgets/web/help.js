// Help in the header: a tour of the page, its words, its keys, and links; all of it with the keyboard.
const OFF = "heartgen-keys-off";

function make(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "html") node.innerHTML = value;
    else if (typeof value === "function") node.addEventListener(name, value);
    else if (value !== false) node.setAttribute(name, value);
  }
  node.append(...children);
  return node;
}

const button = (title, click, kind = "") =>
  make("button", { type: "button", class: `jupyter-button ${kind}`, click }, title);

// The keys of the page are heard where nothing is being written, and under Voila alone: JupyterLab
// has keys of its own.
function isFree(event) {
  const at = event.target;
  return document.body.dataset.voila && !event.ctrlKey && !event.metaKey && !event.altKey
    && !at.isContentEditable && !at.closest("input, select, textarea, dialog")
    && !localStorage.getItem(OFF);
}

function glossary(words) {
  const found = make("p", { class: "hg-note", role: "status" });
  const lists = new Map();
  const entries = words.map((each) => {
    const unit = each.unit ? ` <span>(${each.unit})</span>` : "";
    const paper = each.paper ? ` <span>In the paper: ${each.paper}.</span>` : "";
    const node = make("div", {},
      make("dt", { html: each.word + unit }), make("dd", { html: each.meaning + paper }));
    if (!lists.has(each.section)) lists.set(each.section, make("dl", { class: "hg-words" }));
    lists.get(each.section).append(node);
    return node;
  });
  const sections = [...lists].map(([title, list]) =>
    make("section", {}, make("h3", {}, title), list));
  const search = make("input", {
    type: "search", "aria-label": "Find a word", placeholder: "Find a word: Q, LoD, Dice, wriggle",
    input: () => {
      const sought = search.value.trim().toLowerCase();
      let count = 0;
      for (const node of entries) {
        node.hidden = !node.textContent.toLowerCase().includes(sought);
        count += !node.hidden;
      }
      for (const part of sections) part.hidden = ![...part.querySelectorAll("div")].some((n) => !n.hidden);
      found.textContent = sought ? `${count} word${count === 1 ? "" : "s"}` : "";
    },
  });
  return make("section", {}, make("h2", {}, "Words"), search, found, ...sections);
}

function keys(shortcuts) {
  const box = make("input", {
    type: "checkbox",
    change: () => (box.checked ? localStorage.removeItem(OFF) : localStorage.setItem(OFF, "yes")),
  });
  box.checked = !localStorage.getItem(OFF);
  const rows = [...shortcuts, { key: "?", title: "This help" }, { key: "Esc", title: "Close help or tour" }];
  return make("section", {}, make("h2", {}, "Keys"),
    make("dl", { class: "hg-keys" }, ...rows.map((each) =>
      make("div", {}, make("dt", {}, make("kbd", {}, each.key)), make("dd", {}, each.title)))),
    make("label", {}, box, " keys are heard"));
}

function links(addresses) {
  return make("section", {}, make("h2", {}, "Links"), make("ul", {}, ...Object.entries(addresses).map(
    ([title, href]) => make("li", {}, make("a", { href, target: "_blank", rel: "noopener" }, title)))));
}

function tour(app, stops, done) {
  let at = 0;
  const title = make("h2", { id: "hg-tour-title", tabindex: "-1" });
  const said = make("p");
  const count = make("span", { class: "hg-note" });
  const back = button("Back", () => show(at - 1));
  const next = button("Next", () => (at + 1 < stops.length ? show(at + 1) : end()), "hg-primary");
  const box = make("div", { class: "hg-tour", role: "dialog", "aria-labelledby": "hg-tour-title" },
    title, said, make("div", {}, count, back, next, button("End", () => end())));
  const ring = make("div", { class: "hg-ring", "aria-hidden": "true" });
  const place = () => {
    const seen = app.querySelector(stops[at].place)?.getBoundingClientRect();
    if (!seen) return;
    const [top, left] = [Math.max(seen.top, 4), Math.max(seen.left, 4)];
    const bottom = Math.min(seen.bottom, innerHeight - 4), right = Math.min(seen.right, innerWidth - 4);
    Object.assign(ring.style, {
      top: `${top}px`, left: `${left}px`, width: `${right - left}px`, height: `${Math.max(bottom - top, 0)}px`,
    });
    const { width, height } = box.getBoundingClientRect();
    const beside = right + 12 + width < innerWidth ? right + 12 : right - width - 12;
    const x = Math.min(Math.max(beside, 8), innerWidth - width - 8);
    const y = Math.min(Math.max(top + 12, 8), innerHeight - height - 8);
    Object.assign(box.style, { left: `${x}px`, top: `${innerWidth < 900 ? innerHeight - height - 8 : y}px` });
  };
  const show = (to) => {
    at = to;
    const stop = stops[at];
    if (stop.click) app.querySelector(stop.click)?.click();
    title.textContent = stop.title;
    said.textContent = stop.text;
    count.textContent = `${at + 1} of ${stops.length}`;
    back.disabled = at === 0;
    next.textContent = at + 1 < stops.length ? "Next" : "Done";
    title.focus();
    setTimeout(() => {
      app.querySelector(stop.place)?.scrollIntoView({ block: "nearest" });
      place();
    }, 150);
  };
  const escape = (event) => { if (event.key === "Escape") end(); };
  const end = () => {
    box.remove();
    ring.remove();
    removeEventListener("resize", place);
    document.removeEventListener("keydown", escape);
    done();
  };
  addEventListener("resize", place);
  document.addEventListener("keydown", escape);
  app.append(ring, box);
  show(0);
  return end;
}

function render({ model, el }) {
  let end = null;
  const app = () => el.closest(".hg-app");
  const begin = () => {
    dialog.close();
    end ??= tour(app(), model.get("tour"), () => { end = null; open.focus(); });
  };
  const open = button("Help", () => dialog.showModal(), "hg-help");
  open.title = "Tour, words, keys and links (press ?)";
  const stops = model.get("tour");
  const close = button("Close", () => dialog.close());
  const head = make("div", { class: "hg-help-head" }, make("h2", {}, "Help"),
    ...(stops.length ? [button(`Tour in ${stops.length} steps`, begin, "hg-primary")] : []), close);
  const dialog = make("dialog", { class: "hg-dialog", "aria-label": "Help" }, head,
    links(model.get("links")), keys(model.get("shortcuts")), glossary(model.get("words")));
  dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
  el.append(open, dialog);
  const hear = (event) => {
    if (!isFree(event) || dialog.open) return;
    if (event.key === "?") return dialog.showModal();
    const meant = model.get("shortcuts").find((each) => each.key === event.key);
    if (meant) app()?.querySelector(meant.click)?.click();
  };
  document.addEventListener("keydown", hear);
  return () => {
    end?.();
    document.removeEventListener("keydown", hear);
  };
}
export default { render };
