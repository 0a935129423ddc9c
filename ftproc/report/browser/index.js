// Sorts the rows by a column, and shows those with some words or verdicts only.
"use strict";
const table = document.querySelector("table.index"), body = table.tBodies[0];
const rows = [...body.rows], heads = [...table.tHead.rows[0].cells];
const LEVELS = ["failed", "unreliable", "suspect", "consistent", "unknown"];

function key(row, column) {
  const text = row.cells[column].textContent.trim(), number = Number(text.replaceAll(",", ""));
  if (LEVELS.includes(text)) return LEVELS.indexOf(text);
  return text === "" || Number.isNaN(number) ? text : number;
}

function compare(a, b) {
  if (a === "" || b === "") return (a === "") - (b === ""); // what is not known comes last
  if (typeof a === "number" && typeof b === "number") return a - b;
  return String(a).localeCompare(String(b), undefined, { numeric: true });
}

function sort(column) {
  const down = heads[column].ariaSort === "ascending", sign = down ? -1 : 1;
  for (const head of heads) head.ariaSort = null;
  heads[column].ariaSort = down ? "descending" : "ascending";
  const keyed = rows.map((row) => [key(row, column), row]);
  const known = keyed.filter(([k]) => k !== ""), other = keyed.filter(([k]) => k === "");
  known.sort(([a], [b]) => sign * compare(a, b));
  body.append(...[...known, ...other].map(([, row]) => row));
}

heads.forEach((head, column) => {
  const button = document.createElement("button");
  button.append(...head.childNodes);
  button.addEventListener("click", () => sort(column));
  head.append(button);
});

const bar = document.createElement("p"), search = document.createElement("input"), shown = document.createElement("span");
bar.className = "filter";
search.type = "search";
search.placeholder = "part of a name or reason";
search.setAttribute("aria-label", "Show only rows with");
const boxes = new Map();
for (const level of LEVELS.filter((each) => rows.some((row) => row.cells[1].textContent === each))) {
  const label = document.createElement("label"), box = document.createElement("input");
  box.type = "checkbox";
  box.checked = true;
  boxes.set(level, box);
  label.append(box, ` ${level}`);
  bar.append(label);
}

function filter() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  for (const row of rows) {
    const text = row.textContent.toLowerCase();
    row.hidden = !boxes.get(row.cells[1].textContent).checked || !words.every((word) => text.includes(word));
  }
  const count = rows.filter((row) => !row.hidden).length;
  shown.textContent = count === rows.length ? "" : `${count} of ${rows.length} shown`;
}

bar.prepend(search);
bar.append(shown);
bar.addEventListener("input", filter);
table.parentElement.before(bar);
document.body.dataset.drawn = "yes";
