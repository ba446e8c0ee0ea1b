// Programs whose devices are those of a UsbTestbed: umockdev's library must be loaded before any other.
#pragma once

namespace relmap::testing {

// First thing in main(): starts this program anew with the library, unless it is there. What it starts inherits it.
void start_under_mock(char** arguments);

// AddressSanitizer or ThreadSanitizer: several times slower.
bool built_with_sanitizer();

}  // namespace relmap::testing
