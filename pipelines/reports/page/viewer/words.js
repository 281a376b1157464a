// Other languages: fixed words of a page, and numbers, are replaced where they stand.

const ATTRIBUTES = ["title", "placeholder", "aria-label", "alt"];
let words = new Map(), patterns = [];

/** Take a catalogue: texts by the English ones; `{}` stands for any text. */
export function setCatalogue(catalogue) {
  words = new Map(Object.entries(catalogue));
  patterns = [...words].filter(([english]) => english.includes("{}")).map(([english, text]) => [
    new RegExp(`^${english.split("{}").map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("(.+?)")}$`, "s"), text]);
}

/** A text in the language of the page; English where the catalogue lacks it. */
export function say(english) {
  const plain = english.trim().replace(/\s+/g, " ");
  if (words.has(plain)) return words.get(plain);
  for (const [pattern, text] of patterns) {
    const found = pattern.exec(plain);
    if (found) return found.slice(1).reduce((told, part) => told.replace("{}", () => part), text);
  }
  return english;
}

/** Put all fixed words and the numbers of tables into the language of the page; the English ones are kept. */
export function translate(root, language) {
  const point = (1.5).toLocaleString(language)[1];
  const walk = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  for (let node = walk.nextNode(); node; node = walk.nextNode()) {
    if (["SCRIPT", "STYLE"].includes(node.parentNode.nodeName) || !node.data.trim()) continue;
    const english = (node.english ??= node.data);
    let text = say(english);
    if (text === english && node.parentNode.closest("td.number")) text = english.replace(/(\d)\.(\d)/g, `$1${point}$2`);
    else if (text !== english) text = english.match(/^\s*/)[0] + text + english.match(/\s*$/)[0];
    if (node.data !== text) node.data = text;
  }
  for (const element of root.querySelectorAll(ATTRIBUTES.map((name) => `[${name}]`).join()))
    for (const name of ATTRIBUTES)
      if (element.hasAttribute(name)) {
        const english = ((element.english ??= {})[name] ??= element.getAttribute(name));
        element.setAttribute(name, say(english));
      }
}
