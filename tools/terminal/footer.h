// The text below the options in --help, divided into what it reads as.
//
// Paragraphs begin at the margin; blank lines divide them. A line that ends in a colon and is followed by indented
// lines is the heading of a list. Below "Examples:" the list consists of commands as one would type them, perhaps with
// a comment behind. Below other headings, as "Exit codes:" and "Files:", it consists of items: a term, two spaces or
// more, and a text that may go on in lines that are indented further.
#pragma once

#include <string>
#include <vector>

namespace relmap::terminal {

struct FooterItem {
  std::string term, text;
};

struct FooterPart {
  std::string paragraph;              // in one line; empty: a list
  std::string heading;                // of a list, without the colon; "Examples" also for one
  std::vector<std::string> commands;  // of examples: the lines, without their common indentation
  std::vector<FooterItem> items;      // of other lists
};

std::vector<FooterPart> parts_of(const std::string& footer);

}  // namespace relmap::terminal
