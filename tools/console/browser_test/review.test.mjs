// Ten wrong closures among about a hundred true ones: an operator finds them in the queue, and removes them safely.
import assert from 'node:assert/strict';
import { after, test } from 'node:test';
import { closeBrowser, copyOfMap, goTo, open, planted, run, shot, startConsole, startDaemon } from './harness.mjs';

after(closeBrowser);

async function queue(page) {
  return page.locator('[aria-label="Closures to look at"] li[data-name]').evaluateAll((rows) => rows.map((row) => row.dataset.name));
}

async function structure(folder) {
  const { edges } = JSON.parse((await run('relmap', ['--server', folder, '--json', 'edges', '--loops'])).trim().split('\n')[0]);
  return edges.map((each) => [JSON.stringify(each.id), each.state, each.carries]);
}

test('all ten planted closures are in the first fifteen of the queue; removal shows in the map, and undo restores it', async (t) => {
  const folder = copyOfMap(t, 'planted');
  await startDaemon(t, folder);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  await goTo(page, 'Review');
  await page.waitForFunction(() => document.querySelectorAll('li[data-name]').length > 15);
  const first = (await queue(page)).slice(0, 15);
  for (const edge of planted()) assert.ok(first.includes(edge), `${edge} is not among ${first.join(', ')}`);
  await shot(page, 'review-planted');

  const before = await structure(folder);
  const versions = await page.evaluate(async () => (await (await fetch('/map/layout')).json()).version);
  await page.getByRole('button', { name: /^Remove/ }).first().click();
  const dialog = page.getByRole('dialog');
  await dialog.getByRole('button', { name: /^Remove/ }).click();
  await page.getByText('Your edits in this tab (1)').waitFor();
  assert.notDeepEqual(await structure(folder), before);
  // The layout follows.
  await page.waitForFunction(
    async (version) => (await (await fetch('/map/layout')).json()).version > version, versions, { polling: 200 });
  await page.keyboard.press('z');
  await dialog.getByRole('button', { name: /^Undo/ }).click();
  await page.getByText('undone').waitFor();
  assert.deepEqual(await structure(folder), before);
});

test('two operators see what the other does', async (t) => {
  const folder = copyOfMap(t, 'planted');
  await startDaemon(t, folder);
  const console = await startConsole(t, folder);
  const [one, other] = [await open(t, console.value), await open(t, console.value)];
  for (const page of [one, other]) {
    await goTo(page, 'Review');
    await page.getByRole('heading', { name: /^Closure / }).waitFor();
  }
  await one.getByRole('button', { name: /^Remove/ }).first().click();
  await one.getByRole('dialog').getByLabel('It alone').check();
  await one.getByRole('dialog').getByText(/other closure/).waitFor();
  await one.getByRole('dialog').getByRole('button', { name: /^Remove/ }).click();
  await one.getByText('Your edits in this tab (1)').waitFor();
  await other.getByText(/changed it: it is now removed/).waitFor();
});

test('what was proposed and accepted is undone in two steps, both of which are told before', async (t) => {
  const folder = copyOfMap(t, 'drive');
  await startDaemon(t, folder);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  await goTo(page, 'Review');
  await page.getByRole('heading', { name: /^Closure / }).waitFor();
  await page.keyboard.press('p');
  const dialog = page.getByRole('dialog');
  await dialog.getByLabel('Put it into force at once').check();
  // Frames beside those that a closure joins.
  const joined = (await structure(folder)).map(([id]) => id);
  for (const other of ['1:54', '1:58', '1:53', '1:59']) {
    await dialog.getByLabel('Frame', { exact: true }).fill('1:0');
    await dialog.getByLabel('Other frame').fill(other);
    await dialog.getByRole('button', { name: 'Compare the two' }).click();
    await dialog.getByText(/Geometry confirms it|No closure between the two/).first().waitFor();
    if (await dialog.getByText('Geometry confirms it').count()) break;
  }
  await dialog.getByRole('button', { name: 'Propose and accept' }).click();
  await page.getByText('Your edits in this tab (1)').waitFor();
  const made = async () => (await structure(folder)).find(([id]) => !joined.includes(id));
  const [, state] = await made();
  await page.keyboard.press('z');
  await dialog.getByText(/in two steps: withdraw the decision, then remove alone/).waitFor();
  await dialog.getByText('Then: remove alone.').waitFor();
  await dialog.getByRole('button', { name: /^Undo/ }).click();
  await page.getByText('Your edits in this tab (3)').waitFor();
  await dialog.waitFor({ state: 'detached' });
  await page.getByText('undone').waitFor();
  assert.notEqual((await made())[1], state);
});
