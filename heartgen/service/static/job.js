// Follows a job by its events; once it has ended, the page is loaded again with the result.
const job = document.getElementById("job");
if (job.dataset.ended === "no") {
  const events = new EventSource(`/v1/jobs/${job.dataset.id}/events`);
  events.addEventListener("job", (event) => {
    const now = JSON.parse(event.data);
    document.getElementById("state").textContent = now.state;
    document.getElementById("told").textContent =
      now.place ? `place ${now.place} in the queue` : now.step || "";
    document.getElementById("progress").value = now.progress;
    if (!["queued", "running"].includes(now.state)) {
      events.close();
      location.reload();
    }
  });
}
