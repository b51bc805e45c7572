// Prints what is installed beside the program and made from its flags. Run by the build.
#include <cstdio>
#include <string>
#include <string_view>

#include "app/completion.hpp"
#include "app/man_page.hpp"
#include "app/program.hpp"

int main(int argc, char** argv) {
    const std::string_view what = argc == 2 ? argv[1] : "";
    const knap::app::Program program = knap::app::make_program();
    std::string document;
    if (what == "man") {
        document = knap::app::man_page(program, KNAP_VERSION);
    } else if (what == "bash") {
        document = knap::app::bash_completion(program);
    } else {
        std::fputs("usage: knap_documents man|bash\n", stderr);
        return 1;
    }
    return std::fputs(document.c_str(), stdout) < 0 || std::fflush(stdout) != 0 ? 2 : 0;
}
