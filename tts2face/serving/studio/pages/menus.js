// Menus that are placed also on a busy page. Quasar tries to place a menu for 60 ms after it is mounted (setPosition, five
// tries 10 ms apart); one that has no size by then stays invisible until its page scrolls.

const AGAIN_MS = 100;
const TRIES = 50; // after a menu, a tooltip or a dialog was mounted
let left = 0;
let waiting = null;

function placeAgain() {
  const menus = [...document.querySelectorAll(".q-position-engine")];
  if (menus.some((menu) => getComputedStyle(menu).visibility !== "visible")) window.dispatchEvent(new Event("scroll"));
  waiting = --left > 0 ? setTimeout(placeAgain, AGAIN_MS) : null;
}

const portals = new MutationObserver((changes) => {
  if (!changes.some((change) => change.addedNodes.length)) return;
  left = TRIES;
  waiting ??= setTimeout(placeAgain, AGAIN_MS);
});
portals.observe(document.body, { childList: true });
