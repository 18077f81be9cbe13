// Bundles the page into the package, with a list of what it contains and under which licence.
//   node build.mjs           the page of `levelhead view`
//   node build.mjs try DIR   the pages that run in the browser alone: the lesson, a phone, a log with Python and without
import { cpSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const here = process.argv[2] !== "try", target = here ? "../src/levelhead/publish/page" : process.argv[3];
const pages = here ? [["index", "main", "levelhead"]] : [ // file, script, title
  ["index", "python", "A log in the browser"], ["plain", "plain", "A CSV in the browser"],
  ["lesson", "lesson", "An accelerometer that jitters, a gyroscope that drifts"], ["phone", "phone", "This phone as a sensor"],
];
rmSync(target, { recursive: true, force: true });
mkdirSync(target, { recursive: true });
const scripts = [...pages.map(([, script]) => script), ...(here ? [] : ["worker", "plain_worker"])];
const { metafile } = await build({
  entryPoints: [...scripts.map((name) => `src/${name}.ts`), "src/style.css"],
  outdir: target, bundle: true, splitting: true, minify: true, format: "esm", target: "es2022", metafile: true, legalComments: "none",
  logLevel: "warning",
});
for (const [file, script, title] of pages) writeFileSync(`${target}/${file}.html`, page(title, script));
cpSync("../docs/_static/logo.svg", `${target}/logo.svg`);

/** A whole page. The server of `levelhead view` sends a policy of its own; static files hold theirs. */
function page(title, script) {
  const policy = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:";
  return readFileSync("page.html", "utf8").replaceAll("{title}", title).replace("{script}", script)
    .replace("{policy}", here ? "" : `<meta http-equiv="Content-Security-Policy" content="${policy}">\n`);
}

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
