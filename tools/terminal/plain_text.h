// Markdown as text for a terminal: enough of it for what programs print of the documents.
#pragma once

#include <cstddef>
#include <string>

namespace relmap::terminal {

// Paragraphs and items of lists are wrapped at `width` columns. Links become their texts; the marks of headings, code
// and emphasis are left out. Blocks of code are indented by four and not wrapped, and code within a line is not broken,
// so that commands can be copied. Ends with a newline unless it is empty.
std::string plain_text(const std::string& markdown, std::size_t width);

}  // namespace relmap::terminal
