// The style sheet of the components, added to a page once.

export function addStyle() {
  if (document.getElementById("studio-style")) return;
  const link = Object.assign(document.createElement("link"), { id: "studio-style", rel: "stylesheet" });
  link.href = new URL("./studio.css", import.meta.url).href;
  document.head.append(link);
}
