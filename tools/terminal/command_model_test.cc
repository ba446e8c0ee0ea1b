#include "tools/terminal/command_model.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <limits>

namespace relmap::terminal {
namespace {

const OptionModel& option_of(const CommandModel& command, const std::string& name) {
  for (const OptionModel& option : command.options)
    if (option.names.back() == name) return option;
  throw std::runtime_error("no option " + name);
}

TEST(CommandModel, TellsWhatValuesOptionsTake) {
  CLI::App app("for a test", "prog");
  std::string text = "time";
  std::vector<std::string> texts;
  double number = 2;
  std::size_t size = 0;
  bool flag = false;
  app.add_option("--by", text, "in\ntwo lines")->check(CLI::IsMember({"distance", "time"}))->capture_default_str();
  app.add_option("--deadline", number)->check(CLI::Range(0.5, 60.0))->envname("DEADLINE");
  app.add_option("--count", size)->check(CLI::Range(std::size_t{1}, std::numeric_limits<std::size_t>::max()));
  app.add_option("--positive", number)->check(CLI::PositiveNumber);
  app.add_option("--size", size)->transform(CLI::AsSizeValue(false));
  app.add_option("--server", text)->type_name("FOLDER|HOST:PORT");
  app.add_option("--all", texts)->type_name("FILE")->required();
  app.add_flag("-q,--quiet", flag)->excludes("--by")->excludes("--all");
  app.add_flag("--hidden", flag)->group("");
  app.add_option("FILE", text);

  const CommandModel model = model_of(app);
  EXPECT_EQ(option_of(model, "--by").words, (std::vector<std::string>{"distance", "time"}));
  EXPECT_EQ(option_of(model, "--by").fallback, "time");
  EXPECT_EQ(option_of(model, "--by").help, "in two lines");
  EXPECT_EQ(option_of(model, "--deadline").value, "NUMBER");
  EXPECT_EQ(option_of(model, "--deadline").bounds, "0.5 to 60");
  EXPECT_EQ(option_of(model, "--deadline").variable, "DEADLINE");
  EXPECT_EQ(option_of(model, "--count").bounds, "at least 1");
  EXPECT_EQ(option_of(model, "--positive").bounds, "more than 0");
  EXPECT_EQ(option_of(model, "--size").value, "SIZE");
  EXPECT_EQ(option_of(model, "--server").value, "FOLDER|HOST:PORT");
  EXPECT_TRUE(option_of(model, "--server").takes_folder());
  EXPECT_FALSE(option_of(model, "--server").takes_file());
  EXPECT_TRUE(option_of(model, "--all").repeated);
  EXPECT_TRUE(option_of(model, "--all").required);
  EXPECT_TRUE(option_of(model, "--quiet").flag());
  EXPECT_EQ(option_of(model, "--quiet").names, (std::vector<std::string>{"-q", "--quiet"}));
  EXPECT_EQ(option_of(model, "--quiet").excludes, (std::vector<std::string>{"--all", "--by"}));
  EXPECT_THROW(option_of(model, "--hidden"), std::runtime_error);
  ASSERT_EQ(model.positionals.size(), 1u);
  EXPECT_EQ(model.positionals[0].names, (std::vector<std::string>{"FILE"}));
}

TEST(CommandModel, HoldsTheCommandsBelow) {
  CLI::App app("for a test", "prog");
  app.fallthrough();
  CLI::App* session = app.add_subcommand("session", "of a map");
  session->add_subcommand("freeze", "stops it")->footer("Example:\n  prog session freeze");
  const CommandModel model = model_of(app);
  EXPECT_TRUE(model.inherited);
  ASSERT_EQ(model.commands.size(), 1u);
  ASSERT_EQ(model.commands[0].commands.size(), 1u);
  EXPECT_EQ(model.commands[0].commands[0].full_name(), "prog session freeze");
  EXPECT_EQ(model.commands[0].commands[0].description, "stops it");
}

}  // namespace
}  // namespace relmap::terminal
