// Runs programs with the devices of a UsbTestbed, for which umockdev's library must be loaded before any other.
#pragma once

namespace relmap::testing {

// To be called first in main(): restarts this program with the library unless it is loaded. Child processes inherit it.
void start_under_mock(char** arguments);

// Whether AddressSanitizer or ThreadSanitizer is active, which makes programs several times slower.
bool built_with_sanitizer();

}  // namespace relmap::testing
