// What the console costs in a real browser: prints one JSON object. Times are of this machine and of a browser that
// draws by the processor; compare them with each other.
//
//   node tools/console/browser_test/figures.mjs [CITY]
//
// Uses the map of the simulated drive (make_maps), and CITY if it is given: the data folder of a large map, of which a
// copy is served (`relmap-bench skeleton --folder CITY` makes one of a million frames).
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { closeBrowser, copyOfMap, goTo, open, run, startConsole } from './harness.mjs';

const city = process.argv[2];
const figures = {};
const cleaning = [];
const test = { after: (step) => cleaning.unshift(step) };
const round = (value) => Number(value.toPrecision(3));
const resident = (pid, what = 'VmHWM') => Number(new RegExp(`${what}:\\s+(\\d+)`).exec(readFileSync(`/proc/${pid}/status`, 'utf8'))[1]) / 1024;

// Bytes on the wire of what a page has asked for, by the beginning of the path.
async function countBytes(page) {
  const session = await page.context().newCDPSession(page);
  const paths = new Map();
  const counted = {};
  await session.send('Network.enable');
  session.on('Network.requestWillBeSent', ({ requestId, request }) => paths.set(requestId, new URL(request.url).pathname));
  session.on('Network.loadingFinished', ({ requestId, encodedDataLength }) => {
    const kind = /^\/(map\/tiles|console\.js|watch_worker\.js|[^/]*)/.exec(paths.get(requestId) ?? '/')[1];
    counted[kind] = (counted[kind] ?? 0) + encodedDataLength;
  });
  return counted;
}

const drawn = () => window.relmapMap && window.relmapMap.vertices > 0;
const whole = () => window.relmapMap?.complete && window.relmapMap.vertices > 0;
const state = (page) => page.evaluate(async () => (await fetch('/map/layout')).json());

// The browser runs already, as an operator's does.
const blank = await open(test, 'about:blank');

{
  const folder = copyOfMap(test, 'drive');
  const begun = performance.now();
  const console = await startConsole(test, folder);
  await blank.goto(console.value);
  await blank.waitForFunction(drawn);
  figures.drive_first_picture_s = round((performance.now() - begun) / 1000);

  await goTo(blank, 'Labels');
  const before = performance.now();
  await run('relmap', ['--server', folder, 'label', '1:7', 'new here']);
  await blank.getByText('new here').first().waitFor();
  figures.event_to_screen_s = round((performance.now() - before) / 1000);

  await goTo(blank, 'Review');
  await blank.getByText(/points of \d+ matched agree/).waitFor();
  await blank.waitForTimeout(1500);
  const steps = [];
  for (let i = 0; i < 10; ++i) {
    steps.push(await blank.evaluate(() => new Promise((done) => {
      const was = document.querySelector('h2 .mono').textContent;
      const begun = performance.now();
      document.body.dispatchEvent(new KeyboardEvent('keydown', { key: 'j', bubbles: true }));
      const look = () => {
        const pictures = [...document.querySelectorAll('.shown img, .shown image, .shown canvas')];
        if (document.querySelector('h2 .mono').textContent !== was && /matched agree/.test(document.body.innerText) &&
            pictures.length && pictures.every((each) => each.complete !== false))
          requestAnimationFrame(() => done(performance.now() - begun));
        else requestAnimationFrame(look);
      };
      look();
    })));
    await blank.waitForTimeout(400);
  }
  figures.next_pair_ms = { median: round(steps.sort((a, b) => a - b)[5]), worst: round(steps.at(-1)) };
  await console.stop();
}

if (city) {
  const folder = join(mkdtempSync(join(tmpdir(), 'relmap-figures-')), 'map');
  cleaning.push(() => rmSync(join(folder, '..'), { recursive: true, force: true }));
  execFileSync('cp', ['-a', '--reflink=auto', city, folder]);
  const cache = mkdtempSync(join(tmpdir(), 'relmap-figures-'));
  cleaning.push(() => rmSync(cache, { recursive: true, force: true }));
  for (const kind of ['city_first', 'city_again']) {
    const page = await open(test, 'about:blank');
    const counted = await countBytes(page);
    const begun = performance.now();
    const since = () => round((performance.now() - begun) / 1000);
    const console = await startConsole(test, folder, ['--cache', cache]);
    await page.goto(console.value);
    await page.waitForFunction(drawn);
    figures[`${kind}_picture_s`] = since();
    await page.waitForFunction(whole);
    figures[`${kind}_interactive_s`] = since();
    figures[`${kind}_coarse`] = (await state(page)).coarse;
    figures[`${kind}_tiles_kb`] = round((counted['map/tiles'] ?? 0) / 1000);
    if (kind === 'city_first') {
      for (let now = await state(page); now.coarse || now.progress; now = await state(page)) await page.waitForTimeout(100);
      figures.city_whole_s = since();
      await page.waitForFunction(whole);
    } else {
      figures.script_kb = round(((counted['console.js'] ?? 0) + (counted['watch_worker.js'] ?? 0)) / 1000);
      await page.mouse.move(800, 450);
      figures.vertices = 0;
      for (let zoom = 0; zoom < 3; ++zoom) {
        figures.vertices = Math.max(figures.vertices, await page.evaluate(() => window.relmapMap.vertices));
        await page.mouse.down();
        for (let i = 0; i < 60; ++i) await page.mouse.move(800 + 4 * i, 450 + 2 * i);
        await page.mouse.up();
        await page.mouse.click(700, 400);
        await page.mouse.move(800, 450);
        await page.mouse.wheel(0, -400);
        await page.waitForFunction(whole);
      }
      const { scriptMs, pickMs } = await page.evaluate(() => ({ scriptMs: window.relmapMap.scriptMs, pickMs: window.relmapMap.pickMs }));
      figures.pan_script_ms = { median: round(scriptMs.median), worst: round(scriptMs.worst) };
      figures.pick_ms = round(pickMs);
      const renderers = execFileSync('ps', ['-eo', 'rss=,args=']).toString().split('\n').filter((line) => /type=renderer/.test(line));
      figures.tab_mb = round(Math.max(...renderers.map((line) => Number.parseInt(line)) ) / 1024);
    }
    figures[`${kind}_console_mb`] = round(resident(console.child.pid));
    await console.stop();
    await page.close();
  }
}

for (const step of cleaning) await step();
await closeBrowser();
process.stdout.write(JSON.stringify(figures, null, 2) + '\n');
