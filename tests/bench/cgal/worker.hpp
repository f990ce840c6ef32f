// SPDX-License-Identifier: GPL-3.0-or-later
// The same conversation as worker.h, and arrays from files.
#ifndef EXM_BENCH_WORKER_HPP
#define EXM_BENCH_WORKER_HPP

#include <cstdint>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <stdexcept>
#include <vector>

namespace worker
{

/// Seconds of processor time.
inline double now()
{
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

inline void answer(double value)
{
  std::cout << "= " << std::setprecision(17) << value << std::endl;
}

inline void ready()
{
  std::cout << "= " << std::endl;
}

/// An array as area files hold it: an int64 count, then the items.
template <class T> std::vector<T> read(std::istream &file)
{
  std::int64_t count = 0;
  file.read(reinterpret_cast<char *>(&count), sizeof count);
  std::vector<T> out(static_cast<std::size_t>(count));
  file.read(reinterpret_cast<char *>(out.data()), static_cast<std::streamsize>(out.size() * sizeof(T)));
  if (!file) {
    throw std::runtime_error("the input is cut short");
  }
  return out;
}

} // namespace worker

#endif
