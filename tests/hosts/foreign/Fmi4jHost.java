import java.io.File;
import java.io.PrintWriter;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.List;

import no.ntnu.ihb.fmi4j.importer.AbstractFmu;

/** Steps an FMU along a table of inputs: FMU, interface, table, outputs (comma-separated), result. */
public class Fmi4jHost {
    public static void main(String[] arguments) throws Exception {
        List<String> lines = Files.readAllLines(Path.of(arguments[2]));
        String[] inputs = lines.get(0).split(",");
        String[] outputs = arguments[3].split(",");
        try (var fmu = AbstractFmu.from(new File(arguments[0]));
                var result = new PrintWriter(arguments[4])) {
            var slave = fmu.asCoSimulationFmu().newInstance("linkage");
            var variables = slave.getModelDescription().getModelVariables();
            long[] set = new long[inputs.length - 1], read = new long[outputs.length];
            for (int i = 0; i < set.length; ++i)
                set[i] = variables.getByName(inputs[i + 1]).getValueReference();
            for (int i = 0; i < read.length; ++i)
                read[i] = variables.getByName(outputs[i]).getValueReference();
            double[] given = new double[set.length], answer = new double[read.length];
            demand(slave.setupExperiment(0, 0, 0) && slave.enterInitializationMode()
                    && slave.exitInitializationMode(), "initialization");
            double[] times = lines.stream().skip(1).mapToDouble(l -> Double.parseDouble(l.split(",")[0])).toArray();
            for (int step = 0; step + 1 < times.length; ++step) {
                String[] row = lines.get(step + 1).split(",");
                for (int i = 0; i < given.length; ++i)
                    given[i] = Double.parseDouble(row[i + 1]);
                demand(slave.writeReal(set, given).isOK(), "setting");
                demand(slave.doStep(times[step], times[step + 1] - times[step]), "step");
                demand(slave.readReal(read, answer).isOK(), "getting");
                result.print(times[step + 1]);
                for (double value : answer)
                    result.print("," + value);
                result.println();
            }
            slave.terminate();
            slave.close();
        }
    }

    private static void demand(boolean holds, String what) {
        if (!holds)
            throw new IllegalStateException(what + " failed");
    }
}
