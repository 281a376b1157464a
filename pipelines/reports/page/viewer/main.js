// Start: the viewers of a page, its language and its theme, and what is printed.

import { readModel, unpacked } from "./data.js";
import { element } from "./panel.js";
import { Viewer } from "./viewer.js";
import { say, setCatalogue, translate } from "./words.js";

/** Fill each `.moma-viewer`, one of several linked to the first; without WebGL say so, and leave tables and pictures. */
async function start() {
  const viewers = [], language = new URLSearchParams(location.hash.replace(/^#/, "")).get("lang"); // before a view takes its place
  for (const root of document.querySelectorAll(".moma-viewer")) {
    const data = document.getElementById(root.dataset.model);
    try {
      const viewer = new Viewer(root, await readModel(data.textContent));
      root.viewer = viewer;
      viewers.push(viewer);
    } catch (error) {
      root.replaceChildren(element("p", { class: "note" }, `${say("No 3D view in this browser; the tables and pictures hold the same numbers.")} (${error.message})`));
      root.classList.add("off");
    }
  }
  viewers[0]?.takeHash(location.hash);
  window.addEventListener("hashchange", () => viewers[0]?.takeHash(location.hash));
  if (viewers.length > 1) link(viewers);
  await languages(language);
  themes(viewers);
  window.addEventListener("beforeprint", () => viewers.forEach(print));
  document.documentElement.dataset.ready = viewers.length;
}

/** Let viewers share camera, and the instant as a share of the time. */
function link(viewers) {
  let busy = false;
  for (const viewer of viewers)
    viewer.listeners.push((told) => {
      if (busy) return;
      busy = true;
      for (const other of viewers)
        if (other !== told) {
          Object.assign(other.camera.state, told.camera.state, { target: [...told.camera.state.target] });
          const instant = Math.round((told.state.instant / Math.max(told.stage.instants - 1, 1)) * (other.stage.instants - 1));
          if (instant !== other.state.instant) other.change({ instant });
          else other.draw();
        }
      busy = false;
    });
}

/** Put a picture of the view where the canvas cannot be printed. */
function print(viewer) {
  viewer.root.querySelector("img.printed")?.remove();
  viewer.root.append(element("img", { class: "printed", alt: viewer.model.title, src: viewer.picture().toDataURL("image/png") }));
}

async function languages(asked) {
  const source = document.getElementById("moma-languages"), menu = document.querySelector("select.language");
  if (!source || !menu) return;
  const catalogues = JSON.parse(new TextDecoder().decode(await unpacked(source.textContent)));
  const choose = (language) => {
    setCatalogue(catalogues[language]?.words ?? {});
    document.documentElement.lang = language;
    translate(document.body, language);
    for (const root of document.querySelectorAll(".moma-viewer")) if (root.viewer) root.viewer.change({ selected: root.viewer.state.selected });
    menu.value = language;
  };
  menu.addEventListener("change", () => choose(menu.value));
  if (catalogues[asked] && asked !== "en") choose(asked);
}

function themes(viewers) {
  const button = document.querySelector("button.theme"), dark = window.matchMedia("(prefers-color-scheme: dark)");
  const set = (theme) => { document.documentElement.dataset.theme = theme; viewers.forEach((one) => one.draw()); };
  set(dark.matches ? "dark" : "light");
  button?.addEventListener("click", () => set(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
}

start();
