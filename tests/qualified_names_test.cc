// Checks that each qualified name has one definition. Two types, aliases or functions with the same qualified name in
// two files are undefined behaviour in a program that contains both, and no diagnostic is required (the one-definition
// rule, [basic.def.odr]). Reads all sources; `tools/test --full` has the linker compare definitions, too (-Wodr).
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/source_tree.h"

namespace relmap::testing {
namespace {

using Tokens = std::vector<std::string>;

// Identifiers, numbers, `::` and single other characters; comments, preprocessor lines and what quotes hold are left
// out.
Tokens tokens_of(const std::string& text) {
  Tokens tokens;
  bool line_begins = true;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    const auto word = [](char letter) { return std::isalnum(static_cast<unsigned char>(letter)) || letter == '_'; };
    if (c == '\n') {
      line_begins = true;
      ++i;
    } else if (std::isspace(static_cast<unsigned char>(c))) {
      ++i;
    } else if (line_begins && c == '#') {
      while (i < text.size() && text[i] != '\n') i += text[i] == '\\' ? 2 : 1;
    } else if (text.compare(i, 2, "//") == 0) {
      i = std::min(text.find('\n', i), text.size());
    } else if (text.compare(i, 2, "/*") == 0) {
      i = std::min(text.find("*/", i), text.size() - 2) + 2;
    } else if (text.compare(i, 2, "R\"") == 0) {
      const std::size_t open = text.find('(', i);
      const std::string close = ")" + text.substr(i + 2, open - i - 2) + "\"";
      i = std::min(text.find(close, open), text.size() - close.size()) + close.size();
      tokens.push_back("\"");
    } else if (c == '"' || c == '\'') {
      for (++i; i < text.size() && text[i] != c;) i += text[i] == '\\' ? 2 : 1;
      ++i;
      tokens.push_back("\"");
    } else if (word(c)) {
      std::size_t end = i;
      const bool number = std::isdigit(static_cast<unsigned char>(c));
      while (end < text.size() && (word(text[end]) || (number && text[end] == '\''))) ++end;
      tokens.push_back(text.substr(i, end - i));
      i = end;
    } else {
      const std::size_t size = text.compare(i, 2, "::") == 0 ? 2 : 1;
      tokens.push_back(text.substr(i, size));
      i += size;
    }
    if (c != '\n' && !std::isspace(static_cast<unsigned char>(c))) line_begins = false;
  }
  return tokens;
}

bool is_word(const std::string& token) { return std::isalpha(static_cast<unsigned char>(token[0])) || token[0] == '_'; }

// What a declaration is without `template <...>` before it and [[attributes]] and alignas(...) within it.
Tokens without_decoration(const Tokens& tokens) {
  Tokens rest;
  const auto skip = [&](std::size_t i, const char* open, const char* close) {
    int depth = 0;
    for (; i < tokens.size(); ++i) {
      depth += tokens[i] == open ? 1 : tokens[i] == close ? -1 : 0;
      if (depth == 0) break;
    }
    return i;
  };
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const bool more = i + 1 < tokens.size();
    if (rest.empty() && tokens[i] == "template" && more)
      i = skip(i + 1, "<", ">");
    else if (tokens[i] == "[" && more && tokens[i + 1] == "[")
      i = skip(i, "[", "]");
    else if (tokens[i] == "alignas")
      i = skip(i + 1, "(", ")");
    else
      rest.push_back(tokens[i]);
  }
  return rest;
}

struct Scope {
  enum Kind { kNamespace, kNameless, kOther } kind = kOther;
  std::string prefix;  // of the names in it: "relmap::storage::"
};

// The name that is defined by what stands before a brace, empty where none is.
std::string defined_before_brace(const Tokens& declaration) {
  const std::set<std::string> keys = {"class", "struct", "union", "enum"};
  if (declaration.empty()) return {};
  if (keys.contains(declaration[0])) {
    std::size_t at = 1;
    if (at < declaration.size() && keys.contains(declaration[at])) ++at;  // enum class
    if (at >= declaration.size() || !is_word(declaration[at])) return {};
    std::string name = declaration[at++];
    while (at + 1 < declaration.size() && declaration[at] == "::") {  // of a class: struct Map::Impl
      name += "::" + declaration[at + 1];
      at += 2;
    }
    const bool specialised = at < declaration.size() && declaration[at] == "<";
    return specialised ? std::string() : name;
  }
  // A function: its name and the types and names of its parameters, which tell overloads apart.
  const auto open = std::find(declaration.begin(), declaration.end(), "(");
  if (open == declaration.end() || open == declaration.begin() || !is_word(*(open - 1))) return {};
  const std::set<std::string> none = {"static", "operator", "=", "catch"};  // internal; told by types; a value; a body
  if (std::any_of(declaration.begin(), open, [&](const std::string& token) { return none.contains(token); })) return {};
  auto begin = open - 1;
  while (begin - declaration.begin() >= 2 && *(begin - 1) == "::" && is_word(*(begin - 2))) begin -= 2;
  std::string name;
  int depth = 0;
  for (auto token = begin; token != declaration.end(); ++token) {
    name += (name.empty() || token <= open ? "" : " ") + *token;
    depth += *token == "(" ? 1 : *token == ")" ? -1 : 0;
    if (depth == 0 && token > open) break;
  }
  return name;
}

// The qualified names that a file defines at the level of named namespaces; not what is internal to it.
std::set<std::string> names_defined_in(const std::string& text) {
  std::set<std::string> names;
  std::vector<Scope> scopes = {{Scope::kNamespace, ""}};
  Tokens statement;
  for (const std::string& token : tokens_of(text)) {
    const bool named = scopes.back().kind == Scope::kNamespace;
    if (token == "{") {
      const Tokens declaration = without_decoration(statement);
      Scope inner;
      const std::size_t at = !declaration.empty() && declaration[0] == "inline" ? 1 : 0;
      if (declaration.size() > at && declaration[at] == "namespace") {
        inner = {declaration.size() > at + 1 ? scopes.back().kind : Scope::kNameless, scopes.back().prefix};
        for (std::size_t i = at + 1; i < declaration.size(); ++i)
          if (declaration[i] != "::") inner.prefix += declaration[i] + "::";
      } else if (declaration.size() == 2 && declaration[0] == "extern") {
        inner = scopes.back();
      } else if (named) {
        const std::string name = defined_before_brace(declaration);
        if (!name.empty()) names.insert(scopes.back().prefix + name);
      }
      scopes.push_back(inner);
      statement.clear();
    } else if (token == "}") {
      if (scopes.size() > 1) scopes.pop_back();
      statement.clear();
    } else if (token == ";") {
      const Tokens declaration = without_decoration(statement);
      if (named && declaration.size() > 3 && declaration[0] == "using" && declaration[2] == "=")
        names.insert(scopes.back().prefix + declaration[1]);
      statement.clear();
    } else {
      statement.push_back(token);
    }
  }
  return names;
}

TEST(QualifiedNames, AreFoundInWhatDefinesThem) {
  const auto names = names_defined_in(R"(
    // class Commented {};
    #define MACRO class Macro {};
    namespace relmap { class Declared; enum class Colour : int { kRed }; }
    namespace relmap::storage {
    struct Edge { struct Inner {}; int x{}; };
    template <typename T> class alignas(16) Table final : public Base<T> {};
    template <> struct Table<int> {};
    using Bytes = std::string;
    namespace { class Hidden {}; }
    inline int add(int a, const std::vector<int>& b) { return a; }
    static void internal() {}
    struct Map::Impl {};
    Status Map::open(const char* text) try { if (text) { return {}; } } catch (const Error& error) { return {}; }
    const char* const kText = "class Quoted {"; std::array<int, 2> values = {1, 2};
    })");
  EXPECT_EQ((std::set<std::string>{"relmap::Colour", "relmap::storage::Edge", "relmap::storage::Table",
                                   "relmap::storage::Bytes", "relmap::storage::Map::Impl",
                                   "relmap::storage::add( int a , const std :: vector < int > & b )",
                                   "relmap::storage::Map::open( const char * text )"}),
            names);
}

TEST(QualifiedNames, HaveOneDefinitionEach) {
  std::map<std::string, std::vector<std::string>> files_of;
  for (const std::string& file : sources_in({"proto", "storage", "server", "client", "frontend", "tools", "tests"}))
    for (const std::string& name : names_defined_in(content_of(file))) files_of[name].push_back(file);
  ASSERT_GT(files_of.size(), 1000u) << "the sources are not read as they ought to be";
  for (const auto& [name, files] : files_of) {
    std::string list;
    for (const std::string& file : files) list += " " + file;
    // Each program has its own main(), and each fuzzer its entry.
    const bool entry = name.starts_with("main(") || name.starts_with("LLVMFuzzerTestOneInput(");
    EXPECT_TRUE(files.size() == 1 || entry) << name << " is defined in" << list;
  }
}

// A header that defines something outside of relmap's namespaces gives every includer a name that it may have itself.
TEST(QualifiedNames, OfHeadersStandInANamespaceOfRelmap) {
  for (const std::string& file : sources_in({"proto", "storage", "server", "client", "frontend", "tools", "tests"})) {
    if (!file.ends_with(".h")) continue;
    for (const std::string& name : names_defined_in(content_of(file)))
      EXPECT_TRUE(name.starts_with("relmap::")) << file << " defines " << name;
  }
}

}  // namespace
}  // namespace relmap::testing
