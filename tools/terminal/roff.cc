#include "tools/terminal/roff.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string_view>

namespace relmap::terminal {

namespace {

constexpr std::size_t kPageWidth = 67;  // characters in an indented paragraph on a terminal of 80 columns
constexpr std::size_t kContinuation = 4;

bool in_option_name(char c) { return c == '-' || std::isalnum(static_cast<unsigned char>(c)) != 0; }

// The spaces of a shell command that are outside quotes and before a comment, and where the comment begins.
struct Spaces {
  std::vector<std::size_t> at;
  std::size_t comment = std::string::npos;
};
Spaces spaces_of(const std::string& command) {
  Spaces spaces;
  char quote = 0;
  for (std::size_t i = 0; i < command.size(); ++i) {
    const char c = command[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"') {
      quote = c;
    } else if (c == ' ') {
      spaces.at.push_back(i);
    } else if (c == '#' && (i == 0 || command[i - 1] == ' ')) {
      spaces.comment = i;
      break;
    }
  }
  return spaces;
}

// Where to divide a command that is too wide: behind a pipe, else before an option, so that its value stays with it,
// else at the last space that fits. 0: nowhere.
std::size_t division_of(const std::string& command) {
  const std::size_t begin = command.find_first_not_of(' ');
  std::size_t space = 0, before_option = 0, behind_pipe = 0;
  for (const std::size_t i : spaces_of(command).at) {
    if (i <= begin || i + 2 > kPageWidth) continue;
    space = i;
    if (command[i - 1] == '|') behind_pipe = i;
    const std::string_view next = std::string_view(command).substr(i + 1);
    if (next.size() > 1 && next[0] == '-' && std::isdigit(static_cast<unsigned char>(next[1])) == 0) before_option = i;
  }
  if (behind_pipe > 0) return behind_pipe;
  return before_option > 0 ? before_option : space;
}

void add_command(std::string command, std::vector<std::string>& lines) {
  const std::size_t comment = spaces_of(command).comment;
  if (command.size() > kPageWidth && comment != std::string::npos && comment > 0) {
    lines.push_back(command.substr(comment));
    command.erase(command.find_last_not_of(' ', comment - 1) + 1);
  }
  while (command.size() > kPageWidth) {
    const std::size_t end = division_of(command);
    if (end == 0) break;
    lines.push_back(command.substr(0, end) + (command[end - 1] == '|' ? "" : " \\"));
    command = std::string(kContinuation, ' ') + command.substr(end + 1);
  }
  lines.push_back(command);
}

// A line that begins with a dot would be a request.
std::string as_text_line(const std::string& escaped) { return escaped.starts_with('.') ? "\\&" + escaped : escaped; }

}  // namespace

std::string roff_escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '\\':
        escaped += "\\e";
        break;
      case '-':  // not a hyphen, so that it can be copied
        escaped += "\\-";
        break;
      case '\'':
        escaped += "\\(aq";
        break;
      case '`':
        escaped += "\\(ga";
        break;
      case '"':
        escaped += "\\(dq";
        break;
      case '^':
        escaped += "\\(ha";
        break;
      case '~':
        escaped += "\\(ti";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string roff_bold(const std::string& text) { return "\\fB" + roff_escaped(text) + "\\fR"; }
std::string roff_italic(const std::string& text) { return "\\fI" + roff_escaped(text) + "\\fR"; }

std::string roff_prose(const std::string& text) {
  std::string prose, plain;
  const auto add_plain = [&] {
    prose += roff_escaped(plain);
    plain.clear();
  };
  for (std::size_t i = 0; i < text.size();) {
    const bool word_begins = i == 0 || text[i - 1] == ' ' || text[i - 1] == '(';
    const std::size_t quoted = text[i] == '`' ? text.find('`', i + 1) : std::string::npos;
    if (quoted != std::string::npos) {
      add_plain();
      prose += roff_bold(text.substr(i + 1, quoted - i - 1));
      i = quoted + 1;
    } else if (word_begins && text.compare(i, 2, "--") == 0 && i + 2 < text.size() && in_option_name(text[i + 2])) {
      add_plain();
      const std::size_t end = static_cast<std::size_t>(
          std::find_if_not(text.begin() + static_cast<std::ptrdiff_t>(i), text.end(), in_option_name) - text.begin());
      prose += roff_bold(text.substr(i, end - i));
      i = end;
    } else {
      plain += text[i++];
    }
  }
  add_plain();
  return as_text_line(prose);
}

std::string roff_commands(const std::vector<std::string>& commands) {
  std::vector<std::string> lines;
  for (const std::string& command : commands) add_command(command, lines);
  std::string text = ".RS 4\n.nf\n";
  for (const std::string& line : lines) text += as_text_line(roff_escaped(line)) + "\n";
  return text + ".fi\n.RE\n";
}

}  // namespace relmap::terminal
