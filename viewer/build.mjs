// Bundles the viewer into the two files that `uas-coverage replay` puts into its pages.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync } from "node:fs";
import { build } from "esbuild";

const out = "../uas_coverage_env/replay";

// tests/replay/test_viewer_bundle.py makes the same sum: it tells when the bundle is out of date
function sourcesSum() {
  const names = readdirSync("src").sort();
  const sum = createHash("sha256");
  for (const path of ["package.json", "build.mjs", ...names.map((name) => `src/${name}`)]) {
    sum.update(path + "\n").update(readFileSync(path)).update("\n");
  }
  return sum.digest("hex");
}

const three = JSON.parse(readFileSync("node_modules/three/package.json", "utf8"));
const licence = readFileSync("node_modules/three/LICENSE", "utf8").trim();
const banner = `/*
Built from viewer/ by "npm ci && npm run build"; do not edit.
sources sha256:${sourcesSum()}

Contains three.js ${three.version}:

${licence}
*/`;

await build({
  entryPoints: [
    { in: "src/main.ts", out: "viewer" },
    { in: "src/style.css", out: "viewer" },
  ],
  outdir: out,
  bundle: true,
  minify: true,
  format: "iife",
  target: ["es2022"],
  // the licence stands in the banner, once
  legalComments: "none",
  banner: { js: banner },
  logLevel: "info",
});
