"use strict";
const all = (selector, within = document) => [...within.querySelectorAll(selector)];

// The gallery: a picture is shown if it is of the scene, stage and method, and its words hold the text.
const filters = document.getElementById("filters");
const tiles = all("#tiles > .tile").map((tile) => ({
  tile,
  scene: tile.dataset.scene,
  stage: tile.dataset.stage,
  methods: tile.dataset.methods?.split(" "),
  words: `${tile.textContent} ${tile.querySelector("img")?.alt ?? ""}`.toLowerCase(),
}));

function filter() {
  const { scene, stage, method, text } = Object.fromEntries(new FormData(filters));
  const words = text.toLowerCase().split(/\s+/);
  let shown = 0;
  for (const each of tiles) {
    const fits = (!scene || each.scene === scene)
      && (!stage || !each.stage || each.stage === stage)
      && (!method || !each.methods || each.methods.includes(method))
      && words.every((word) => each.words.includes(word));
    each.tile.hidden = !fits;
    shown += fits && each.stage !== undefined;
  }
  const pictures = tiles.filter((each) => each.stage !== undefined).length;
  document.getElementById("count").value = `${shown} of ${pictures} pictures`;
}

for (const kind of ["input", "change"]) filters.addEventListener(kind, filter);
filters.addEventListener("submit", (event) => event.preventDefault());
filters.addEventListener("reset", (event) => {
  event.preventDefault();
  for (const field of filters.elements) if (field.name) field.value = "";
  filter();
});
filter();

// A picture, large.
const large = document.getElementById("large");
document.addEventListener("click", (event) => {
  const image = event.target.closest(".zoom")?.querySelector("img");
  if (image) {
    const copy = document.getElementById("large-picture");
    copy.src = image.src;
    copy.alt = image.alt;
    document.getElementById("large-text").textContent = image.alt;
    large.showModal();
  } else if (event.target === large) {
    large.close();
  }
});

// Charts: which of several is shown.
for (const chooser of all("[data-chooser]")) {
  const choose = () => {
    for (const figure of all("[data-panel]", chooser.closest(".card"))) figure.hidden = figure.dataset.panel !== chooser.value;
  };
  chooser.addEventListener("change", choose);
  choose();
}

// Charts: the figures of the mark at the pointer, under the finger, or with the focus.
const tip = document.getElementById("tip");

function light(within, key) {
  for (const chart of all(".chart", within)) {
    chart.classList.toggle("dim", key !== undefined);
    for (const each of all("[data-key]", chart)) each.classList.toggle("on", each.dataset.key === key);
  }
}

function show(chart, mark) {
  for (const each of all(".mark.at")) each.classList.remove("at");
  light(chart.parentElement, mark?.dataset.key);
  tip.hidden = !mark;
  if (!mark) return;
  mark.classList.add("at");
  const [, name, figures] = mark.getAttribute("aria-label").match(/^(.*?): (.*)$/s);
  const bold = document.createElement("b");
  bold.textContent = name;
  tip.replaceChildren(bold, ...figures.split("; ").flatMap((line) => [line, document.createElement("br")]).slice(0, -1));
  const box = chart.getBoundingClientRect(), scale = box.width / chart.viewBox.baseVal.width;
  const x = box.left + mark.dataset.x * scale, y = box.top + mark.dataset.y * scale;
  const left = Math.min(Math.max(x - tip.offsetWidth / 2, 8), document.documentElement.clientWidth - tip.offsetWidth - 8);
  const above = y - tip.offsetHeight - 14;
  tip.style.left = `${left}px`;
  tip.style.top = `${above > 8 ? above : y + 14}px`;
}

function nearest(chart, event) {
  const box = chart.getBoundingClientRect(), scale = box.width / chart.viewBox.baseVal.width;
  const far = (mark) => Math.hypot(box.left + mark.dataset.x * scale - event.clientX, box.top + mark.dataset.y * scale - event.clientY);
  const [mark] = all(".mark", chart).sort((a, b) => far(a) - far(b));
  return mark && far(mark) < (event.pointerType === "touch" ? 40 : 24) ? mark : undefined;
}

for (const chart of all(".chart")) {
  const marks = all(".mark", chart);
  for (const kind of ["pointermove", "pointerdown"]) chart.addEventListener(kind, (event) => show(chart, nearest(chart, event)));
  chart.addEventListener("pointerleave", (event) => { if (event.pointerType !== "touch") show(chart); });
  chart.addEventListener("focusin", (event) => {
    for (const mark of marks) mark.tabIndex = mark === event.target ? 0 : -1;
    show(chart, event.target);
  });
  chart.addEventListener("focusout", () => show(chart));
  chart.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    marks[(marks.indexOf(event.target) + step + marks.length) % marks.length].focus();
  });
}
function hide() {
  for (const mark of all(".mark.at")) show(mark.closest(".chart"));
}
document.addEventListener("keydown", (event) => { if (event.key === "Escape") hide(); });
document.addEventListener("scroll", () => { if (!document.activeElement.closest(".chart")) hide(); }, { passive: true });

// Keys of a legend light up what is theirs, in all charts of the group.
for (const legend of all(".keys")) {
  const charts = legend.nextElementSibling;
  legend.addEventListener("pointerover", (event) => light(charts, event.target.closest("li")?.dataset.key));
  legend.addEventListener("pointerleave", () => light(charts));
}
