// The table of relmapd's settings: how each is read and written in YAML, and what it means. The configuration file, its
// commented sample, --print-config, the table in server/README.md and what SIGHUP can change all follow from it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/ops/config.h"

namespace YAML {
class Node;
}

namespace relmap::ops {

struct Setting {
  std::string key;      // "rpc.threads": of the section `rpc`
  std::string values;   // what it may be, in words
  std::string meaning;  // in words, without a full stop at the end
  bool live = false;    // SIGHUP puts a changed value in force; others need a restart
  // What the default is, in words, where it is not a value.
  std::string default_is = {};

  // Reads the value into the configuration. Returns what is wrong with it; empty if nothing is.
  std::function<std::string(const YAML::Node&, Config&)> set;
  // The value as YAML, on one line.
  std::function<std::string(const Config&)> get;
};

// In the order in which people read them.
const std::vector<Setting>& settings();
// Null if there is none of this name.
const Setting* find_setting(const std::string& key);

// A line "key: value" for each setting, which read_config() reads back as the same configuration.
std::string print_config(const Config& config);

// A file with all settings, their meanings and defaults, all of it commented out.
std::string sample_config();

// The rows of the table of settings in server/README.md.
std::string settings_table();

// Puts what `fresh` says of live settings into `config`. Returns a line for each other setting that differs, with its
// values: NEEDS_RESTART.
std::vector<Status> adopt_live(const Config& fresh, Config& config);

}  // namespace relmap::ops
