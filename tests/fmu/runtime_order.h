/* Every FMI function called in every state of an instance. */
#include "runtime_calls.h"

/* A new instance brought to the state that the letter stands for. */
static Fmu brought_to(char state)
{
    Fmu f = fmu(library, version, exchange), *it = &f;
    if (state == 'X') CHECK(leave(it) == 3);
    if (strchr("NESCT", state)) CHECK(enter(it) == 0);
    if (strchr("ESCT", state)) CHECK(leave(it) == 0);
    if (state == 'C') CHECK(update(it) == 0 && continuous(it) == 0);
    if (state == 'T') CHECK(terminate(it) == 0);
    return f;
}

/* Calls one function with legal arguments. */
static int called(void *c, int number, void *saved, const unsigned char *given, size_t size, void **kept)
{
    const unsigned input = Z, force = FORCE;
    double x[4] = { 1e-6, 0.0, 0.0, 0.0 };
    int flags[2], at = 0;
    fmi3Boolean yes[6];
    fmi2EventInfo info;
    fmi2Status status;
    const char *text;
    void *fresh = NULL;
    unsigned char bytes[2048];
    int answer = -1;
    CHECK(size <= sizeof bytes);
    memcpy(bytes, given, size);
#define CALL_ONE(name, arguments) \
    if (at++ == number) answer = (int)CALL(library, name) arguments;
    if (version == 2) { CALLS_2(CALL_ONE) } else { CALLS_3(CALL_ONE) }
    *kept = fresh;
    return answer;
}

/* Every function in every state: what it answered, and what it said. */
static void order(void)
{
#define CALL_NAME(name, arguments) #name,
    static const char *const names2[] = { CALLS_2(CALL_NAME) NULL }, *const names3[] = { CALLS_3(CALL_NAME) NULL };
    const char *const *names = version == 2 ? names2 : names3, *state;
    int i;
    for (i = 0; names[i]; i++)
        for (state = exchange ? "INECTX" : "INSTX"; *state; state++) {
            Fmu f = brought_to(*state), other = fmu(library, version, exchange), *it = &f;
            void *held = NULL, *kept = NULL;
            unsigned char bytes[2048];
            size_t size = 0;
            int answer;
            double x;
            CHECK(save(&other, &held) == 0 && saved_size(&other, held, &size) == 0);
            CHECK(pack(&other, held, bytes, size) == 0);
            told.count = 0, told.text[0] = 0;
            answer = called(f.c, i, held, bytes, size, &kept);
            printf("%s\t%c\t%d\t%s\n", names[i], *state, answer, told.count ? told.text : "");
            if (answer == 3) {
                CHECK(told.status == 3 && strcmp(told.category, "logStatusError") == 0);
                /* An instance in error reads and steps no more; a reset makes it new. */
                CHECK(get(it, FORCE, &x) == 3 && enter(it) == 3 && save(it, &held) == 3);
                CHECK(reset(it) == 0 && enter(it) == 0 && leave(it) == 0 && get(it, FORCE, &x) == 0);
            }
            if (kept) CHECK(drop(&other, &kept) == 0);
            CHECK(drop(&other, &held) == 0);
            fmu_free(it), fmu_free(&other);
        }
}
