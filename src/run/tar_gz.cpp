#include "run/tar_gz.hpp"

#include <boost/beast/zlib/deflate_stream.hpp>
#include <boost/crc.hpp>
#include <cstdio>

#include "core/base/check.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kBlock = 512;

std::string octal(std::size_t value, int digits) {
  std::string text(static_cast<std::size_t>(digits) + 1, '\0');
  std::snprintf(text.data(), text.size(), "%0*zo", digits, value);
  return text;  // with its zero
}

std::string header(const PackedFile& file, std::time_t time) {
  CONNECT_CHECK(file.name.size() <= 99);
  std::string block = file.name;
  block.resize(100);
  block += octal(0600, 7) + octal(0, 7) + octal(0, 7) + octal(file.text.size(), 11) +
           octal(static_cast<std::size_t>(time), 11);
  block += std::string(8, ' ') + '0';  // as the checksum counts itself; a regular file
  block.resize(257);
  block += std::string(
      "ustar\0"
      "00",
      8);
  block.resize(kBlock);
  std::size_t sum = 0;
  for (const char c : block) sum += static_cast<unsigned char>(c);
  block.replace(148, 8, octal(sum, 6) + ' ');
  return block;
}

std::string little_endian(std::uint32_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

std::string deflated(const std::string& text) {
  namespace zlib = boost::beast::zlib;
  zlib::deflate_stream stream;
  std::string out(stream.upper_bound(text.size()) + 64, '\0');
  zlib::z_params params;
  params.next_in = text.data();
  params.avail_in = text.size();
  params.next_out = out.data();
  params.avail_out = out.size();
  boost::system::error_code ended;
  stream.write(params, zlib::Flush::finish, ended);
  CONNECT_CHECK(ended == zlib::error::end_of_stream);  // there is room for all of it
  out.resize(params.total_out);
  return out;
}

}  // namespace

std::string tar_gz(const std::vector<PackedFile>& files, std::time_t time) {
  std::string tar;
  for (const PackedFile& file : files) {
    tar += header(file, time) + file.text;
    tar.resize((tar.size() + kBlock - 1) / kBlock * kBlock);
  }
  tar.resize(tar.size() + 2 * kBlock);
  boost::crc_32_type crc;
  crc.process_bytes(tar.data(), tar.size());
  const std::string begin("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10);
  return begin + deflated(tar) + little_endian(crc.checksum()) +
         little_endian(static_cast<std::uint32_t>(tar.size()));
}

}  // namespace connect_bridge
