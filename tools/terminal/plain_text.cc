#include "tools/terminal/plain_text.h"

#include <cctype>
#include <sstream>

#include "tools/terminal/console.h"

namespace relmap::terminal {

namespace {

constexpr char kUnbroken = '\x01';  // stands for a blank at which no line is broken

// The text of a paragraph without its marks.
std::string without_marks(const std::string& markdown) {
  std::string text;
  bool code = false;
  for (std::size_t at = 0; at < markdown.size(); ++at) {
    const char c = markdown[at];
    if (c == '`') {
      code = !code;
    } else if (code) {
      text += c == ' ' ? kUnbroken : c;
    } else if (c == '*' && markdown.compare(at, 2, "**") == 0) {
      ++at;
    } else if (c == ']' && markdown.compare(at, 2, "](") == 0 && markdown.find(')', at) != std::string::npos) {
      at = markdown.find(')', at);
    } else if (c != '[') {
      text += c;
    }
  }
  return text;
}

// Wraps at blanks. The first line begins with `lead`, the others are indented as far.
std::string wrapped(const std::string& text, const std::string& lead, std::size_t width) {
  std::istringstream words(text);
  std::string lines, line = lead;
  bool empty = true;  // no word in `line` yet
  for (std::string word; words >> word;) {
    if (!empty && width_of(line) + 1 + width_of(word) > width) {
      lines += line + '\n';
      line.assign(lead.size(), ' ');
      empty = true;
    }
    line += (empty ? "" : " ") + word;
    empty = false;
  }
  for (char& c : lines += line + '\n')
    if (c == kUnbroken) c = ' ';
  return lines;
}

// The length of "- " or "12. " at the beginning of an item; 0: it is none.
std::size_t bullet_of(const std::string& line) {
  if (line.starts_with("- ")) return 2;
  std::size_t digits = 0;
  while (digits < line.size() && std::isdigit(static_cast<unsigned char>(line[digits]))) ++digits;
  return digits > 0 && line.compare(digits, 2, ". ") == 0 ? digits + 2 : 0;
}

class Renderer {
 public:
  explicit Renderer(std::size_t width) : width_(width) {}

  void take(const std::string& line) {
    if (line.starts_with("```")) {
      end_paragraph();
      code_ = !code_;
      return;
    }
    if (code_) {
      text_ += (line.empty() ? "" : "    " + line) + '\n';
      return;
    }
    if (line.empty()) {
      end_paragraph();
      text_ += '\n';
      return;
    }
    if (line.starts_with('#')) {
      end_paragraph();
      text_ += line.substr(line.find_first_not_of("# ")) + '\n';
      return;
    }
    if (const std::size_t bullet = bullet_of(line); bullet > 0) {
      end_paragraph();
      lead_ = line.substr(0, bullet);
      paragraph_ = line.substr(bullet);
      return;
    }
    paragraph_ += (paragraph_.empty() ? "" : " ") + line;
  }

  std::string text() {
    end_paragraph();
    text_.erase(text_.find_last_not_of('\n') + 1);
    return text_.empty() ? text_ : text_ + '\n';
  }

 private:
  void end_paragraph() {
    if (!paragraph_.empty()) text_ += wrapped(without_marks(paragraph_), lead_, width_);
    paragraph_.clear();
    lead_.clear();
  }

  const std::size_t width_;
  bool code_ = false;
  std::string text_, paragraph_, lead_;
};

}  // namespace

std::string plain_text(const std::string& markdown, std::size_t width) {
  Renderer renderer(width);
  std::istringstream lines(markdown);
  for (std::string line; std::getline(lines, line);) renderer.take(line);
  return renderer.text();
}

}  // namespace relmap::terminal
