// Runs the page's model of a run without a browser: node page_model.js FOLDER, with {about, chunks, ask} on standard input.
// Appends the chunks to a run and prints the answers to what is asked: expressions about `it`, the run.
"use strict";
const fs = require("fs"), path = require("path"), vm = require("vm");
const { about, chunks, ask } = JSON.parse(fs.readFileSync(0, "utf-8"));
for (const name of ["base.js", "model.js"]) vm.runInThisContext(fs.readFileSync(path.join(process.argv[2], name), "utf-8"));
globalThis.given = { about, chunks };
vm.runInThisContext("const it = new Run(given.about); for (const rows of given.chunks) it.append(rows);");
const plain = value => (ArrayBuffer.isView(value) ? [...value] : value);
const finite = (_, value) => (typeof value === "number" && !Number.isFinite(value) ? null : value);
for (const expression of ask) console.log(JSON.stringify(plain(vm.runInThisContext(expression)), finite));
