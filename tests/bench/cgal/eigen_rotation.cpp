// SPDX-License-Identifier: GPL-3.0-or-later
// Closest rotations by Eigen's JacobiSVD, one matrix at a time: bench_rotation.c's peer, with the same conversation.
#include <Eigen/Dense>
#include <string>

#include "worker.hpp"

using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

static Matrix closest(const Matrix &matrix)
{
  Eigen::JacobiSVD<Matrix> const svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix left = svd.matrixU();
  if ((left * svd.matrixV().transpose()).determinant() < 0) {
    left.col(2) *= -1;
  }
  return left * svd.matrixV().transpose();
}

int main(int argc, char **argv)
{
  std::ifstream file(argc == 2 ? argv[1] : "", std::ios::binary);
  std::int64_t count = 0;
  file.read(reinterpret_cast<char *>(&count), sizeof count);
  std::vector<Matrix> matrices(static_cast<std::size_t>(count)), rotations(matrices.size());
  file.read(reinterpret_cast<char *>(matrices.data()), count * static_cast<std::int64_t>(sizeof(Matrix)));
  if (!file) {
    std::cerr << "usage: eigen_rotation FILE\n";
    return 1;
  }
  worker::ready();
  for (std::string command; std::getline(std::cin, command);) {
    double const start = worker::now();
    for (std::size_t i = 0; i < matrices.size(); i++) {
      rotations[i] = closest(matrices[i]);
    }
    double const seconds = worker::now() - start;
    double trace = 0;
    for (std::size_t i = 0; i < matrices.size(); i++) {
      trace += matrices[i].cwiseProduct(rotations[i]).sum();
    }
    worker::answer(command == "trace" ? trace : seconds / static_cast<double>(count));
  }
}
