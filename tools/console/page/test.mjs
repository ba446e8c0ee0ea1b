// Runs test/*.test.ts: bundles each for node, and gives them to its test runner. `npm test`; needs src/proto.
import { spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import * as esbuild from 'esbuild';

process.chdir(dirname(fileURLToPath(import.meta.url)));
if (!existsSync('src/proto')) spawnSync('./update_stubs', { stdio: 'inherit' });
const out = mkdtempSync(join(tmpdir(), 'relmap-page-test-'));
try {
  await esbuild.build({
    entryPoints: readdirSync('test').filter((name) => name.endsWith('.test.ts')).map((name) => join('test', name)),
    bundle: true, platform: 'node', format: 'esm', outdir: out, outExtension: { '.js': '.mjs' }, logLevel: 'warning',
  });
  const files = readdirSync(out).map((name) => join(out, name));
  process.exitCode = spawnSync(process.execPath, ['--test', ...files], { stdio: 'inherit' }).status ?? 1;
} finally {
  rmSync(out, { recursive: true, force: true });
}
