// Asks the kernel from time to time whether it is there, and says so when it no longer is.
function render({ model, el }) {
  const notice = document.createElement("p");
  notice.className = "hg-gone";
  notice.setAttribute("role", "alert");
  notice.hidden = true;
  const kept = model.get("kept");
  notice.append(
    "The session behind this page has ended: it needed too much memory, or was left. ",
    kept ? "What was done is kept. " : "",
  );
  const again = document.createElement("button");
  again.type = "button";
  again.textContent = kept ? "Bring it back" : "Begin anew";
  again.addEventListener("click", () => window.location.reload());
  notice.append(again);
  el.appendChild(notice);
  let heard = Date.now();
  const hear = () => {
    heard = Date.now();
    notice.hidden = true;
  };
  model.on("msg:custom", hear);
  const beat = setInterval(() => {
    notice.hidden = Date.now() - heard < model.get("patience") * 1000;
    try {
      model.send({ kind: "ask" });
    } catch {
      // The kernel's channel is closed: the notice comes in time.
    }
  }, model.get("interval") * 1000);
  return () => { clearInterval(beat); model.off("msg:custom", hear); };
}
export default { render };
