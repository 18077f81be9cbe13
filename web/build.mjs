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
for (const [file, source, script, title] of here ? [["index", "index", "app", "levelhead"]] : [["index", "try", "app", "levelhead in the browser"],
  ["lesson", "lesson", "lesson", "The lesson, live: levelhead"], ["phone", "phone", "phone", "This phone as a sensor: levelhead"]]) {
  writeFileSync(`${target}/${file}.html`, page(title, script, readFileSync(`${source}.html`, "utf8")));
}
cpSync("../docs/_static/logo.svg", `${target}/logo.svg`);

/** A whole page of its body. The server of `levelhead view` sends a policy of its own; static files hold theirs. */
function page(title, script, body) {
  const policy = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:";
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>${title}</title>
${here ? "" : `<meta http-equiv="Content-Security-Policy" content="${policy}">\n`}<link rel="icon" href="logo.svg">
<link rel="stylesheet" href="style.css">
<script type="module" src="${script}.js"></script>
</head>
<body>
${body}</body>
</html>
`;
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
