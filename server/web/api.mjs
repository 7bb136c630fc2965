// The HTTP interface for reading: what openapi.json says, nothing more. Text is only ever set
// as text, so that nothing the document says can become markup.

import { themeButton } from './theme.mjs';

/** An element with attributes and children; strings become text. */
function element(name, attributes = {}, ...children) {
  const node = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children.filter((child) => child != null));
  return node;
}

/** What `$ref` points to, one level deep. */
function resolve(document_, value) {
  if (!value?.$ref) return value ?? {};
  return value.$ref.replace(/^#\//, "").split("/").reduce((at, key) => at?.[key], document_) ?? {};
}

function table(heads, rows) {
  const line = (cell, texts) => element("tr", {}, ...texts.map((text) => element(cell, {}, text)));
  return element("table", {}, line("th", heads), ...rows.map((row) => line("td", row)));
}

function schema(document_, value) {
  return element("pre", {}, JSON.stringify(resolve(document_, value), null, 2));
}

/** The forms of a body: one line each, with its schema behind. */
function forms(document_, content = {}) {
  return Object.entries(content).map(([type, { schema: value }]) =>
    value
      ? element("details", {}, element("summary", {}, element("code", {}, type)), schema(document_, value))
      : element("p", {}, element("code", {}, type)));
}

function operation(document_, method, path, said) {
  const title = element("summary", {},
    element("span", { class: "method" }, method.toUpperCase()), element("code", {}, path), ` ${said.summary ?? ""}`);
  const box = element("details", { class: "operation" }, title);
  if (said.description) box.append(element("p", {}, said.description));
  if (said.parameters?.length) {
    box.append(element("h3", {}, "Parameters"), table(["name", "in", "meaning"], said.parameters.map((p) =>
      [p.name, p.in + (p.required ? ", due" : ""), p.description ?? ""])));
  }
  if (said.requestBody) box.append(element("h3", {}, "Body"), ...forms(document_, said.requestBody.content));
  box.append(element("h3", {}, "Answers"));
  for (const [status, answer] of Object.entries(said.responses)) {
    const { description, content } = resolve(document_, answer);
    box.append(element("p", {}, element("b", {}, status), ` ${description ?? ""}`), ...forms(document_, content));
  }
  if (method === "get" && !path.includes("{") && path !== "/v1/session") {
    box.append(element("p", {}, element("a", { href: `.${path}` }, `Open ${path}`)));
  }
  box.dataset.text = `${method} ${path} ${said.summary ?? ""} ${said.description ?? ""}`.toLowerCase();
  return box;
}

/** Shows the operations by tag, in the document's order. */
function show(document_, operations) {
  const groups = new Map();
  for (const [path, methods] of Object.entries(document_.paths)) {
    for (const [method, said] of Object.entries(methods)) {
      const tag = said.tags?.[0] ?? "other";
      if (!groups.has(tag)) groups.set(tag, element("section", {}, element("h2", {}, tag)));
      groups.get(tag).append(operation(document_, method, path, said));
    }
  }
  operations.replaceChildren(...groups.values());
}

themeButton(document.getElementById("theme"));
const about = document.getElementById("about");
const operations = document.getElementById("operations");
try {
  const response = await fetch("openapi.json");
  if (!response.ok) throw new Error(`the server answered ${response.status}`);
  const said = await response.json();
  show(said, operations);
  about.replaceChildren(`${said.info.description} Version ${said.info.version}; as `,
    element("a", { href: "openapi.json" }, "openapi.json"), ".");
} catch (error) {
  about.replaceChildren(`openapi.json cannot be read: ${error.message}`);
}
document.getElementById("find").addEventListener("input", ({ target }) => {
  const word = target.value.trim().toLowerCase();
  for (const box of operations.querySelectorAll(".operation")) box.hidden = !box.dataset.text.includes(word);
});
