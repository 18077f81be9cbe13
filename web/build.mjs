// Bundles the page into the package, with a list of what it contains and under which licence.
//   node build.mjs           the page of `levelhead view`
//   node build.mjs try DIR   the pages that run in the browser alone: the lesson, a log, a phone
import { cpSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const here = process.argv[2] !== "try", target = here ? "../src/levelhead/publish/page" : process.argv[3];
rmSync(target, { recursive: true, force: true });
mkdirSync(target, { recursive: true });
const { metafile } = await build({
  entryPoints: { ...(here ? { app: "src/main.ts" } : { app: "src/try.ts", worker: "src/worker.ts", lesson: "src/lesson.ts", phone: "src/phone.ts" }), style: "src/style.css" },
  outdir: target, bundle: true, minify: true, format: "esm", target: "es2022", metafile: true, legalComments: "none",
  logLevel: "warning",
});
cpSync(here ? "index.html" : "try.html", `${target}/index.html`);
if (!here) for (const page of ["lesson.html", "phone.html"]) cpSync(page, `${target}/${page}`);
cpSync("../docs/_static/logo.svg", `${target}/logo.svg`);

const packages = new Set(Object.keys(metafile.inputs).filter((path) => path.startsWith("node_modules/"))
  .map((path) => path.split("/").slice(1, path.startsWith("node_modules/@") ? 3 : 2).join("/")));
const parts = [...packages].sort().map((name) => {
  const about = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  if (!["MIT", "BSD-2-Clause", "BSD-3-Clause", "ISC", "Apache-2.0"].includes(about.license)) {
    throw new Error(`${name} has the licence ${about.license}, which levelhead does not ship`);
  }
  const text = ["LICENSE", "LICENSE.md", "license"].map((file) => {
    try { return readFileSync(`node_modules/${name}/${file}`, "utf8"); } catch { return ""; }
  }).find((one) => one) ?? "";
  return `${name} ${about.version}, ${about.license}\n\n${text.trim()}\n`;
});
writeFileSync(`${target}/licences.txt`, parts.join(`\n${"-".repeat(80)}\n\n`));
