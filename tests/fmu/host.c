/* A host without Python: loads an FMI 2.0 binary the way a simulation tool does.
 *
 * usage: host LIBRARY
 * Exit status 0 and the FMI version on standard output, or 1 and the loader's message on standard error. */

#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

typedef const char *version_function(void);

int main(int argc, char **argv)
{
    void *library, *address;
    version_function *version;

    if (argc != 2) {
        fprintf(stderr, "usage: host LIBRARY\n");
        return 2;
    }
    /* RTLD_NOW: every symbol must be found at once; RTLD_LOCAL: nothing leaks to other libraries. */
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    address = dlsym(library, "fmi2GetVersion");
    if (!address) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    /* ISO C has no conversion from an object pointer to a function pointer. */
    memcpy(&version, &address, sizeof version);
    printf("%s\n", version());
    return dlclose(library);
}
