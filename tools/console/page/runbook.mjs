// docs/runbook.md as a page: each heading has an id by which the console links to it (/runbook.html#DISK_FULL).
import { Marked } from 'marked';

const escape = (text) => text.replace(/[&<>"']/g, (letter) => `&#${letter.charCodeAt(0)};`);

// DISK_FULL and RelmapDown stay as they are; "Where to look first" becomes where-to-look-first.
export function idOf(heading) {
  return /^\w+$/.test(heading) ? heading : heading.toLowerCase().replace(/[^a-z0-9]+/g, '-').replace(/^-|-$/g, '');
}

// Returns the page of HTML. Raw HTML in the text is shown as it is written, and only links within the page and to
// http(s) stay links: the other documents are not served.
export function runbookPage(markdown) {
  const contents = [];
  const marked = new Marked({
    renderer: {
      heading({ tokens, depth, text }) {
        const id = idOf(text);
        if (depth > 1) contents.push({ id, depth, text });
        return `<h${depth} id="${escape(id)}">${this.parser.parseInline(tokens)}</h${depth}>\n`;
      },
      html: ({ text }) => escape(text),
      image: ({ text }) => escape(text),
      link({ href, tokens }) {
        const text = this.parser.parseInline(tokens);
        return /^(https?:|#)/.test(href) ? `<a href="${escape(href)}" rel="noopener">${text}</a>` : text;
      },
      codespan({ text }) {
        const code = `<code>${escape(text)}</code>`;
        return named.has(text) ? `<a href="#${text}">${code}</a>` : code;
      },
    },
  });
  const named = new Set(marked.lexer(markdown).filter((token) => token.type === 'heading').map((token) => idOf(token.text)));
  const body = marked.parse(markdown);
  const items = contents.map(({ id, depth, text }) => `<li class="level${depth}"><a href="#${escape(id)}">${escape(text)}</a></li>`);
  return `<!doctype html>
<html lang="en">
  <head>
    <meta charset="utf-8" />
    <meta name="viewport" content="width=device-width, initial-scale=1" />
    <meta name="color-scheme" content="light dark" />
    <title>Runbook · relmap</title>
    <link rel="icon" href="/icon.svg" type="image/svg+xml" />
    <link rel="stylesheet" href="/console.css" />
    <link rel="stylesheet" href="/runbook.css" />
  </head>
  <body class="runbook">
    <nav aria-label="Contents"><a href="/">Console</a><details><summary>Contents</summary><ul>
${items.join('\n')}
    </ul></details></nav>
    <main>
${body}
    </main>
  </body>
</html>
`;
}
