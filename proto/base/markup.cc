#include "proto/base/markup.h"

#include "proto/base/visible_text.h"

namespace relmap {

std::string markup_text(std::string_view utf8) {
  std::string out;
  for (const char c : visible_text(utf8)) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  return out;
}

}  // namespace relmap
