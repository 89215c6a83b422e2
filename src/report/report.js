"use strict";
// Tables are sorted by a press on a column's name, and copied for a spreadsheet. Without this the page is complete.
(() => {
  // The number that a text begins with: of "1.064 [1.056, 1.074] x" it is 1.064. A date or a checksum is no number.
  const leadingNumber = (text) => {
    const found = /^[-+\u2212]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?(?=$|[\s,;:%x)\]])/i.exec(text);
    return found ? Number(found[0].replace("\u2212", "-")) : NaN;
  };
  const textOf = (row, column) => (row.cells[column]?.textContent ?? "").trim();
  // Numbers by size before texts by alphabet; empty cells last, whatever the direction.
  const compare = (a, b, direction) => {
    if ((a === "") !== (b === "")) return a === "" ? 1 : -1;
    const [x, y] = [leadingNumber(a), leadingNumber(b)];
    if (Number.isNaN(x) !== Number.isNaN(y)) return Number.isNaN(x) ? 1 : -1;
    return direction * (Number.isNaN(x) ? a.localeCompare(b, "en", { numeric: true }) : x - y);
  };
  const next = { none: "ascending", ascending: "descending", descending: "none" };

  const makeSortable = (table) => {
    const body = table.tBodies[0];
    const original = [...body.rows];
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = head.textContent;
      if (!head.textContent.trim()) button.setAttribute("aria-label", "the rows' names");
      head.replaceChildren(button);
      head.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const order = next[head.getAttribute("aria-sort")];
        heads.forEach((other) => other.setAttribute("aria-sort", other === head ? order : "none"));
        const direction = order === "descending" ? -1 : 1;
        const sorted = (a, b) => compare(textOf(a, column), textOf(b, column), direction);
        body.append(...(order === "none" ? original : [...original].sort(sorted)));
      });
    });
  };

  // A spreadsheet would run a cell that begins like a formula.
  const harmless = (text) => (/^[=+@\-]/.test(text) && Number.isNaN(leadingNumber(text)) ? "'" + text : text);
  const separated = (table) => {
    const cells = (row) => [...row.cells].map((cell) => harmless(cell.textContent.trim().replace(/\s+/g, " ")));
    return [...table.rows].map((row) => cells(row).join("\t")).join("\n") + "\n";
  };
  const copy = async (text) => {
    try {
      await navigator.clipboard.writeText(text);
      return true;
    } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      const done = document.execCommand("copy");
      area.remove();
      return done;
    }
  };
  const makeCopyable = (table) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "copy";
    button.textContent = "Copy table";
    button.setAttribute("aria-live", "polite");
    button.addEventListener("click", async () => {
      button.textContent = (await copy(separated(table))) ? "Copied" : "Not copied: the browser does not allow it";
      setTimeout(() => (button.textContent = "Copy table"), 2000);
    });
    table.closest(".table").append(button);
  };

  for (const table of document.querySelectorAll("table")) {
    makeSortable(table);
    makeCopyable(table);
  }
})();
