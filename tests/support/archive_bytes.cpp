#include "support/archive_bytes.hpp"

#include <algorithm>
#include <vector>

#include "support/clouds.hpp"

namespace knap::test {

std::string archive_bytes(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) {
            files.push_back(entry.path());
        }
    }
    std::sort(files.begin(), files.end());
    std::string all;
    for (const auto& file : files) {
        all += std::filesystem::relative(file, folder).string() + "\n" + read_bytes(file);
    }
    return all;
}

}  // namespace knap::test
