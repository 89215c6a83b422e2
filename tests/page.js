// Presses buttons as a reader does, and leaves what came of it in the page.
addEventListener("load", () => {
  const result = {};
  const tables = [...document.querySelectorAll("table")];
  const heads = [...document.querySelectorAll("thead th")];
  result.tables = tables.length;
  result.sortable = heads.every((head) => head.getAttribute("aria-sort") === "none" && head.querySelector("button"));
  result.copyable = document.querySelectorAll("button.copy").length;
  const column = (table, k) => [...table.tBodies[0].rows].map((row) => row.cells[k].textContent);
  const press = (table, k) => {
    const head = table.tHead.rows[0].cells[k];
    head.querySelector("button").focus();
    document.activeElement.click();
    return { order: head.getAttribute("aria-sort"), cells: column(table, k), first: column(table, 0) };
  };
  const pressed = (selector, k) => {
    const table = document.querySelector(selector);
    return { before: column(table, k), names: column(table, 0), after: [0, 1, 2].map(() => press(table, k)) };
  };
  result.effort = pressed("#repeating ~ .table table", 3);
  result.intervals = pressed("#chunks table", 1);
  result.words = pressed("#claims ~ .table table", 1);
  press(document.querySelector("#repeating ~ .table table"), 0);
  press(document.querySelector("#repeating ~ .table table"), 1);
  result.sorted = document.querySelectorAll("#repeating ~ .table [aria-sort=ascending]").length;
  Object.defineProperty(navigator, "clipboard", { value: { writeText: async (text) => { result.copied = text; } } });
  document.querySelector("#table2 .copy").click();
  result.wide = document.documentElement.scrollWidth;
  result.window = innerWidth;
  result.dark = matchMedia("(prefers-color-scheme: dark)").matches;
  result.ground = getComputedStyle(document.querySelector("figure svg rect")).fill;
  document.body.textContent = "RESULT" + JSON.stringify(result) + "RESULT";
});
