// Gives every control the text that explains it on hover, whenever a control is drawn.
function explain(hints) {
  for (const [name, hint] of Object.entries(hints)) {
    for (const control of document.getElementsByClassName(name)) {
      for (const part of [control, ...control.querySelectorAll("input, select, [title]")]) {
        if (part.title !== hint) part.title = hint;
      }
    }
  }
}

function render({ model }) {
  const draw = () => explain(model.get("hints"));
  const watch = new MutationObserver(draw);
  watch.observe(document.body, { childList: true, subtree: true });
  model.on("change:hints", draw);
  draw();
  return () => {
    watch.disconnect();
    model.off("change:hints", draw);
  };
}
export default { render };
