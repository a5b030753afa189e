// Runs axe-core over every page of a folder, in light and in dark: node check.mjs FOLDER
// Ends with status 1 where a page violates a rule, 2 where there is no page.

import { readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";

const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const folder = process.argv[2];
const pages = readdirSync(folder, { recursive: true })
  .filter((name) => name.endsWith(".html"))
  .sort();
if (pages.length === 0) {
  console.error(`no page in ${folder}`);
  process.exit(2);
}

const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox"],
});
let violations = 0;
let passes = 0;
for (const name of pages) {
  for (const scheme of ["light", "dark"]) {
    const page = await browser.newPage();
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
    await page.goto(pathToFileURL(join(folder, name)).href);
    // What is folded away is looked at as well.
    await page.evaluate(() => {
      for (const details of document.querySelectorAll("details")) details.open = true;
    });
    await page.addScriptTag({ path: axe });
    const found = await page.evaluate(() => globalThis.axe.run());
    passes += found.passes.length;
    for (const { id, impact, help, nodes } of found.violations) {
      violations += nodes.length;
      console.log(`${name}, ${scheme}: ${id} (${impact}): ${help}, ${nodes.length} times`);
      for (const node of nodes.slice(0, 3)) {
        console.log(`    ${node.target.join(" ")}: ${node.html.slice(0, 160)}`);
        for (const { message } of [...node.any, ...node.all].slice(0, 1)) console.log(`        ${message}`);
      }
    }
    await page.close();
  }
}
await browser.close();
console.log(`${pages.length} pages in light and dark: ${passes} rules passed, ${violations} violations`);
process.exit(violations > 0 || passes === 0 ? 1 : 0);
