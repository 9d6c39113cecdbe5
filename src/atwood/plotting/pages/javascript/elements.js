// Elements of the document, numbers as people read them, and colours.

/** Return a new element; attributes beginning with "on" are listeners, children are elements or texts. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, String(value));
  }
  made.append(...children.filter((one) => one !== null && one !== undefined));
  return made;
}

const ICONS = {
  play: "M4 2.5v11l9-5.5z", pause: "M4 2.5h3v11H4zM9 2.5h3v11H9z", back: "M3 2.5h2v11H3zM13 2.5v11L6 8z",
  forward: "M11 2.5h2v11h-2zM3 2.5v11L10 8z", start: "M2 2.5h2v11H2zM9 2.5v11L4.5 8zM14 2.5v11L9.5 8z",
};

/** Return a picture for a button; what it means is said by the button's label. */
export function icon(name) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  for (const [key, value] of [["viewBox", "0 0 16 16"], ["width", 16], ["height", 16], ["aria-hidden", true]]) made.setAttribute(key, value);
  path.setAttribute("d", ICONS[name]);
  path.setAttribute("fill", "currentColor");
  made.append(path);
  return made;
}

/** Return a number with some significant digits, without zeros that say nothing. */
export function shortNumber(value, digits = 5) {
  if (!Number.isFinite(value)) return String(value);
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(digits)));
}

/** Return a unit for people; a plain number has none. */
export function unitText(unit) {
  return unit === "1" || unit === "any" || !unit ? "" : ` ${unit}`;
}

export const COLOURS = ["#2a6fbb", "#d1495b", "#1f7d53", "#9a6700", "#7b5ea7", "#1c7f91", "#8a6d5a", "#b83a85"];

/** Return near matches of a path among those that are known, best first. */
export function nearMatches(wanted, known) {
  const distance = (a, b) => {
    let row = Array.from({ length: b.length + 1 }, (_, k) => k);
    for (let i = 1; i <= a.length; i += 1) {
      const next = [i];
      for (let j = 1; j <= b.length; j += 1) {
        next.push(Math.min(next[j - 1] + 1, row[j] + 1, row[j - 1] + (a[i - 1] === b[j - 1] ? 0 : 1)));
      }
      row = next;
    }
    return row[b.length];
  };
  return known
    .map((path) => [distance(wanted, path), path])
    .filter(([apart, path]) => apart <= Math.max(2, 0.4 * path.length))
    .sort((a, b) => a[0] - b[0])
    .slice(0, 3)
    .map(([, path]) => path);
}

/** Hand a file to the person who looks at the page. */
export function download(name, content, type) {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
