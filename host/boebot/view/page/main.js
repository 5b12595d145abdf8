// Begins: with the run that is in the page, or by asking the server for the one that goes on.

function start() {
  readColours();
  listenToArena();
  listenToTracks();
  listenToPointer();
  listenToTime();
  const sizes = new ResizeObserver(() => run && resize()); // of the window, or a lane more
  for (const id of ["stage", "cursor"]) sizes.observe($(id));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readColours();
    if (run) {
      namesShown = -1;
      makePanels();
      viewChanged();
      tracksChanged();
    }
  });
  if (pageIsLive) connect();
  else show(page);
}
// #t=12.3 in the address opens the page at that moment, #robot=2&t=12.3 with another robot's signals.
function show(content) {
  begin(content);
  const chosen = Number((/[#&]robot=(\d+)/.exec(location.hash) || [0, 1])[1]),
    at = /[#&]t=([\d.]+)/.exec(location.hash);
  run = runs[Math.min(runs.length, Math.max(1, chosen)) - 1];
  now = at ? Math.min(run.duration, Number(at[1])) : 0;
  chooseRobot(runs.indexOf(run));
}
start();
