// What goes wrong beside the page: the daemon dies and comes back, a token expires or is of a reader, names are hostile.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { readFileSync } from 'node:fs';
import { after, test } from 'node:test';
import { bin, closeBrowser, copyOfMap, goTo, open, run, shot, start, startConsole, startDaemon, temporaryFolder } from './harness.mjs';

after(closeBrowser);

test('a daemon that is killed is told of, and the page goes on when it is back', async (t) => {
  const folder = copyOfMap(t, 'drive');
  const daemon = await startDaemon(t, folder);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  await page.waitForFunction(() => window.relmapMap?.complete);
  await daemon.stop('SIGKILL');
  await page.getByText('daemon away').waitFor();
  await shot(page, 'daemon-away');
  await goTo(page, 'Labels');
  await startDaemon(t, folder);
  await page.getByText('live', { exact: true }).waitFor();
  await page.getByText('fountain').first().waitFor();
});

test('names of others are drawn as text, however hostile', async (t) => {
  const folder = copyOfMap(t, 'drive');
  await startDaemon(t, folder);
  const hostile = '<img src=x onerror=document.title="owned">';
  await run('relmap', ['--server', folder, 'label', '1:10', hostile]);
  await run('relmap', ['--server', folder, 'label', '1:12', 'abc\u202Edlrow\u202C']);
  const console = await startConsole(t, folder);
  const page = await open(t, console.value);
  for (const view of ['Map', 'Labels']) {
    await goTo(page, view);
    // On the map labels are drawn on a canvas.
    if (view === 'Map') await page.waitForFunction(() => window.relmapMap?.complete);
    else await page.getByText(hostile).first().waitFor();
    assert.equal(await page.locator('img[src="x"]').count(), 0);
    assert.notEqual(await page.title(), 'owned');
  }
  assert.equal(await page.getByText('\u202E').count(), 0);
  await shot(page, 'hostile-names');
});

test('a reader sees everything, and is offered no edit; a revoked token asks for another', async (t) => {
  const folder = copyOfMap(t, 'drive');
  const credentials = join(temporaryFolder(t), 'credentials');
  await run('relmap-admin', ['credentials', 'ca', credentials, '--host', '127.0.0.1']);
  await run('relmap-admin', ['credentials', 'new', credentials, 'dashboard', '--role', 'reader', '--token', '--out', join(credentials, 'reader.pem')]);
  const port = 20000 + Math.floor(Math.random() * 20000);
  await startDaemon(t, folder, ['--listen', `127.0.0.1:${port}`, '--credentials', credentials]);
  const console = await startConsole(t, `127.0.0.1:${port}`, ['--credentials', join(credentials, 'ca.crt')]);
  const page = await open(t, console.value);
  await shot(page, 'login');
  await page.getByLabel("Token", { exact: true }).fill('not a token');
  await page.getByRole('button', { name: 'Log in' }).click();
  await page.getByText('The login failed.').waitFor();
  const [, body] = /BEGIN RELMAP TOKEN-----([^-]*)-----/.exec(readFileSync(join(credentials, 'reader.pem'), 'utf8'));
  const token = Buffer.from(body, 'base64').toString();
  await page.getByLabel("Token", { exact: true }).fill(token);
  await page.getByRole('button', { name: 'Log in' }).click();
  await page.getByText('dashboard (reader)').waitFor();
  await page.waitForFunction(() => window.relmapMap?.complete && window.relmapMap.vertices > 0);
  await goTo(page, 'Review');
  await page.getByText('closures are edited by operators').waitFor();
  assert.equal(await page.getByRole('button', { name: /^Remove/ }).count(), 0);
  await run('relmap-admin', ['credentials', 'revoke', credentials, 'dashboard']);
  await page.getByText('You have to log in again.').waitFor();
});
