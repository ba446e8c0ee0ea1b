// Builds the page into dist/, which is checked in and becomes part of relmap-console. The same sources give the same
// bytes on every machine. `node build.mjs OUT` builds into another folder; `--watch` builds again at each change.
import { execFileSync } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync } from 'node:zlib';
import * as esbuild from 'esbuild';
import sveltePlugin from 'esbuild-svelte';
import { runbookPage } from './runbook.mjs';

const here = dirname(fileURLToPath(import.meta.url));
process.chdir(here);
const watching = process.argv.includes('--watch');
const out = process.argv.slice(2).find((argument) => !argument.startsWith('--')) ?? 'dist';

execFileSync('./update_stubs', { stdio: 'inherit' });
rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });

const options = {
  entryPoints: { console: 'src/main.ts', watch_worker: 'src/watch_worker.ts' },
  bundle: true,
  minify: true,
  format: 'iife',
  target: ['chrome110', 'firefox115', 'safari16.4'],
  outdir: out,
  charset: 'utf8',
  legalComments: 'none', // licenses.txt has them all
  logLevel: 'warning',
  mainFields: ['svelte', 'browser', 'module', 'main'],
  conditions: ['svelte', 'browser'],
  plugins: [plainDescriptors(), sveltePlugin({ compilerOptions: { css: 'external', runes: true, modernAst: true } })],
};

for (const file of ['index.html', 'icon.svg', 'runbook.css']) copyFileSync(join('src', file), join(out, file));
writeFileSync(join(out, 'runbook.html'), runbookPage(readFileSync('../../../docs/runbook.md', 'utf8')));
writeFileSync(join(out, 'licenses.txt'), licenses());

if (watching) {
  const context = await esbuild.context(options);
  await context.watch();
} else {
  await esbuild.build(options);
  const scripts = readdirSync(out).filter((name) => name.endsWith('.js'));
  const size = scripts.reduce((sum, name) => sum + brotliCompressSync(readFileSync(join(out, name))).length, 0);
  const limit = 150_000;
  console.error(`build: ${scripts.join(', ')}: ${size} bytes compressed (Brotli), of ${limit} at most`);
  if (size > limit) process.exit(1);
}

// The stubs hold descriptions of their messages in base64, in which a compressor finds none of the names that repeat. As
// plain text they are 5 kB smaller on the wire.
function plainDescriptors() {
  const plain = (stubs) => stubs.replace(/fileDesc\("([^"]*)"/, (_, text) => `fileDesc(btoa(${JSON.stringify(atob(text))})`);
  return {
    name: 'plain-descriptors',
    setup: (build) =>
      build.onLoad({ filter: /_pb\.ts$/ }, ({ path }) => ({ loader: 'ts', contents: plain(readFileSync(path, 'utf8')) })),
  };
}

// The licences of what becomes part of the page, by package.
function licenses() {
  const { packages } = JSON.parse(readFileSync('package-lock.json', 'utf8'));
  let text = 'The console contains these packages, under these licences.\n';
  for (const [path, entry] of Object.entries(packages)) {
    if (!path || entry.dev || entry.optional) continue;
    const name = readdirSync(path).find((file) => /^licen[sc]e/i.test(file));
    const { license, author, homepage } = JSON.parse(readFileSync(join(path, 'package.json'), 'utf8'));
    const by = typeof author === 'object' ? author.name : author;
    text += `\n\n==== ${path.replace('node_modules/', '')} ${entry.version} (${license})\n\n`;
    text += name && existsSync(join(path, name)) ? readFileSync(join(path, name), 'utf8').trim() + '\n'
      : `${by ?? homepage ?? ''}\n`;
  }
  return text;
}
