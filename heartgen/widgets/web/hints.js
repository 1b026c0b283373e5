// Gives every control the text that explains it on hover, its name and its role, whenever one is drawn.
const SOON = 30; // milliseconds in which changes of the page are gathered

function explain(hints) {
  for (const [name, hint] of Object.entries(hints)) {
    for (const control of document.getElementsByClassName(name)) {
      for (const part of [control, ...control.querySelectorAll("input, select, [title]")]) {
        if (part.title !== hint) part.title = hint;
      }
    }
  }
}

function set(element, name, value) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

function mark(attributes) {
  for (const [name, given] of Object.entries(attributes)) {
    for (const element of document.getElementsByClassName(name)) {
      for (const [key, value] of Object.entries(given)) set(element, key, value);
    }
  }
}

// ipywidgets ties labels to fields, but not to sliders and groups of buttons.
function label() {
  for (const control of document.querySelectorAll(".hg-app .widget-slider")) {
    const said = control.querySelector(".widget-label")?.textContent || control.title;
    for (const part of control.querySelectorAll(".noUi-handle, .widget-readout")) {
      set(part, "aria-label", said);
    }
    for (const part of control.querySelectorAll(".widget-readout")) set(part, "role", "textbox");
  }
  for (const group of document.querySelectorAll(".hg-app .widget-toggle-buttons")) {
    set(group, "role", "group");
    set(group, "aria-label", group.querySelector(".widget-label")?.textContent || "Choices");
    for (const choice of group.querySelectorAll("button")) {
      set(choice, "aria-pressed", String(choice.classList.contains("mod-active")));
    }
  }
}

// Arrow keys go from tab to tab, as those who use a screen reader expect.
function walk(event) {
  const tab = event.target.closest?.(".hg-app [role=tab]");
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!tab || !step || event.defaultPrevented) return;
  const all = [...tab.closest("[role=tablist]").querySelectorAll("[role=tab]")];
  const next = all[(all.indexOf(tab) + step + all.length) % all.length];
  event.preventDefault();
  next.focus();
  next.click();
}

function render({ model }) {
  let waiting = null;
  const draw = () => {
    waiting = null;
    explain(model.get("hints"));
    mark(model.get("attributes"));
    label();
  };
  const soon = () => { waiting ??= setTimeout(draw, SOON); };
  const watch = new MutationObserver(soon);
  watch.observe(document.body, {
    childList: true, subtree: true, attributes: true, attributeFilter: ["class"],
  });
  document.addEventListener("keydown", walk);
  model.on("change", soon);
  draw();
  return () => {
    watch.disconnect();
    clearTimeout(waiting);
    document.removeEventListener("keydown", walk);
    model.off("change", soon);
  };
}
export default { render };
