// Bearer tokens (RFC 6750): 256 random bits. Whoever checks them keeps their hashes only, so that a stolen list lets
// nobody in. Hashes need neither salt nor many rounds, since such a token cannot be guessed.
#pragma once

#include <string>
#include <string_view>

namespace relmap::access {

// 64 hexadecimal digits from OpenSSL's generator. Throws std::runtime_error if the system has no randomness.
std::string new_token();

// SHA-256, in hexadecimal.
std::string sha256(std::string_view bytes);

}  // namespace relmap::access
